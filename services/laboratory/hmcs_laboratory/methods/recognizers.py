"""The recognizers of `hmcs.recognition` as online methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.learning import learn
from hmcs.recognition.registry import kind_named, recognizer_of, settings_of
from hmcs.task import Task
from hmcs_laboratory.methods.online import Fresh, OnlineMethod


def recognizer(
    kind: str,
    source: str,
    given: Mapping[str, str] | None = None,
    *,
    variant: str = "",
    marked: bool = False,
) -> OnlineMethod:
    """Return the online method `hmcs-KIND`, or `hmcs-KIND-VARIANT`, of a registered kind.

    `given` are settings of the kind that differ from its defaults, as `settings_of` takes them.
    """

    def learned(
        task: Task, demonstrations: Sequence[Demonstration], rng: np.random.Generator
    ) -> Fresh:
        settings = settings_of(kind_named(kind), given or {})
        model = learn(task, demonstrations, settings, recognizer=kind, rng=rng)
        return lambda: recognizer_of(model)

    name = "-".join(part for part in ("hmcs", kind, variant) if part)
    return OnlineMethod(name, source, learned, marked)
