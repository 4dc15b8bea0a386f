"""Training: references to demonstrations in, a model file out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from hmcs.bus.keys import check_name
from hmcs.recognition.disagreement import check_agreement
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import save_model
from hmcs.recognition.recognizers import DEFAULT, kind_named, settings_of
from hmcs.recognition.segments import segments_of
from hmcs.recognition.selection import choose
from hmcs.task import load_task
from hmcs_trainer.references import read_references


def train(
    task: str,
    references: list[str],
    output: str | Path,
    *,
    name: str | None = None,
    recognizer: str = DEFAULT,
    settings: Mapping[str, str] | None = None,
    choices: Mapping[str, Sequence[str]] | None = None,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
    fits: Callable[[int, int], None] = lambda _done, _all: None,
) -> Model:
    """Learn a model of the task, a shipped one's name or a file, and write it to `output`.

    The model is called `name`, or as the task is. `recognizer` is the kind to learn for, with
    `settings` of its own as text; of `choices` the best by held-out likelihood is taken, `fits` is
    told how many of all fits are done. What is random is drawn with `seed`. Raises a UserError that
    says what is wrong with the task, a reference, a demonstration, the name, the recognizer or a
    setting.
    """
    loaded = load_task(task)
    if name is not None:
        check_name("model", name)
    progress("reading demonstrations")
    demonstrations = read_references(references, loaded)
    check_agreement(loaded, segments_of(loaded, demonstrations))
    if choices:
        selection = choose(
            loaded,
            demonstrations,
            choices,
            recognizer=recognizer,
            given=settings,
            seed=seed,
            progress=fits,
        )
        for judged in selection.judged:
            values = " ".join(f"{name}={value}" for name, value in judged.chosen.items())
            progress(f"{judged.log_probability:+.4f} ± {judged.spread:.4f} nats a step: {values}")
        chosen = selection.settings
    else:
        chosen = settings_of(kind_named(recognizer), settings or {})
    model = learn(
        loaded,
        demonstrations,
        chosen,
        recognizer=recognizer,
        rng=np.random.default_rng(seed),
        progress=progress,
    )
    return save_model(model._replace(name=name or model.name), output)
