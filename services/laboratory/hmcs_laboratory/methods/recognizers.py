"""The recognizers of `hmcs.recognition`, all that are registered, as online methods."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.learning import learn
from hmcs.recognition.recognizers import kinds, recognizer_of
from hmcs.task import Task
from hmcs_laboratory.methods.online import Fresh, OnlineMethod


def registered_recognizers() -> tuple[OnlineMethod, ...]:
    """Return a method `hmcs-KIND` for each registered kind of recognizer."""
    return tuple(online(kind.name, kind.source) for kind in kinds())


def online(recognizer: str, source: str) -> OnlineMethod:
    """Return a kind of recognizer as an online method, with its default settings."""

    def learned(
        task: Task, demonstrations: Sequence[Demonstration], rng: np.random.Generator
    ) -> Fresh:
        model = learn(task, demonstrations, recognizer=recognizer, rng=rng)
        return lambda: recognizer_of(model)

    return OnlineMethod(f"hmcs-{recognizer}", source, learned)
