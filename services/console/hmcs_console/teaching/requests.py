"""What may be asked for on the page; each is one message or question of the contract."""

from __future__ import annotations

import re

from hmcs.bus.keys import KeyNameError, check_name
from hmcs.bus.messages import Ask, Label, Record, Step, Train
from hmcs.bus.verbs import CANCEL, RECORD, TRAIN
from hmcs.errors import UserError
from hmcs.recognizer_takeover import Question


class RequestError(UserError):
    """A request that nobody could carry out; says what is wrong with it."""


def record(on: bool, name: str) -> Question:
    """Return the request to begin or to end a recording."""
    return Question("recorder", RECORD, Record(on=on, name=name.strip()))


def train(
    model: str, task: str, demonstrations: str, recognizer: str, *, find_states: bool = False
) -> Question:
    """Return the request for a training; demonstrations are separated by commas or blanks.

    Raises RequestError where there is no name for the model, or one that cannot be, no task, or
    nothing to learn from.
    """
    files = tuple(part for part in re.split(r"[,\s]+", demonstrations) if part)
    try:
        check_name("model", model.strip())
    except KeyNameError as error:
        raise RequestError(f"nothing is trained: {error}") from error
    if not task.strip():
        raise RequestError("nothing is trained: name a task that comes along, or a task file")
    if not files:
        raise RequestError(
            "nothing is trained: name the recordings to learn from, e.g. take-1.mcap"
        )
    return Question(
        "trainer",
        TRAIN,
        Train(
            model=model.strip(),
            task=task.strip(),
            demonstrations=files,
            recognizer=recognizer.strip(),
            find_states=find_states,
        ),
    )


def cancel() -> Question:
    """Return the request that what is being trained is not trained any further."""
    return Question("trainer", CANCEL, Ask())


def label(state: str, clock: str, last: Step | None) -> Label:
    """Return what says that the hand is in a state from the step on that it is making now."""
    return Label(state=state, clock=clock, step=0 if last is None else last.index + 1)
