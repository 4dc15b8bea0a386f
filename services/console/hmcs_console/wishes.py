"""What may be asked for on the page; each wish is one message or one question of the contract."""

from __future__ import annotations

import re
from typing import NamedTuple

from hmcs.bus.messages import (
    ActivateRecognizer,
    Label,
    LoadModel,
    Message,
    Record,
    Step,
    Train,
    TrainingProgress,
)


class Question(NamedTuple):
    """A wish that a process carries out."""

    service: str
    verb: str
    body: Message


def record(on: bool, name: str) -> Question:
    """Return the wish to begin or to end a recording."""
    return Question("recorder", "record", Record(on=on, name=name.strip()))


def activate(recognizer: str) -> Question:
    """Return the wish that the fixture follows a recognizer."""
    return Question("fixture_controller", "activate", ActivateRecognizer(model=recognizer))


def take_over(trained: TrainingProgress | None) -> tuple[Question, ...]:
    """Return the wishes, one after another, that make the fixture follow what was trained.

    None where nothing was trained to its end.
    """
    if trained is None or trained.stage != "done":
        return ()
    load = LoadModel(path=trained.path)
    return (
        Question("fixture_controller", "load_model", load),
        Question("recognizer", "load_model", load),
        activate(trained.model),
    )


def train(model: str, task: str, demonstrations: str, recognizer: str) -> Question:
    """Return the wish for a training; demonstrations are told apart by commas or blanks."""
    files = tuple(part for part in re.split(r"[,\s]+", demonstrations) if part)
    return Question(
        "trainer",
        "train",
        Train(
            model=model.strip(),
            task=task.strip(),
            demonstrations=files,
            recognizer=recognizer.strip(),
        ),
    )


def label(state: str, clock: str, last: Step | None) -> Label:
    """Return what says that the hand is in a state from the step on that it is making now."""
    return Label(state=state, clock=clock, step=0 if last is None else last.index + 1)
