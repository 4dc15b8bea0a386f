"""`hmcs mark`: what the operator says of the motion while it is made."""

from __future__ import annotations

import time

from hmcs.bus.messages import Ask, Label, LastStepsQuestion
from hmcs.bus.session import Bus
from hmcs.bus.verbs import DESCRIBE, LAST_STEPS
from hmcs.errors import UserError
from hmcs.shown import plain
from hmcs.task.values import unknown_name_message
from hmcs_local.asking import NobodyAnswersError

HEARD_S = 1.0
"""So long is waited for somebody who writes it down."""


def _check_known(bus: Bus, state: str) -> None:
    """Raise UserError where robots say which states their task has and this is none of them."""
    answers = DESCRIBE.ask(bus, Ask(), service="robot")
    listed = (answer.body.facts.get("states", "") for answer in answers)
    known = [name for names in listed for name in names.split(", ") if name]
    # A label may name the gesteme as well, STATE/GESTEME; an empty one ends what was marked.
    if state and known and state.partition("/")[0] not in known:
        raise UserError(unknown_name_message("state", state, dict.fromkeys(known)))


def mark(bus: Bus, state: str) -> str:
    """Say that the hand is in `state` from its next step on; return what was said.

    Where several input devices make steps it is said from this moment on: which of them is the hand
    cannot be known. Raises UserError for a state that the task of the robots does not have,
    NobodyAnswersError where nobody listens.
    """
    _check_known(bus, state)
    labels = bus.publisher(Label, bus.keys.label)
    answers = LAST_STEPS.ask(bus, LastStepsQuestion(count=1))
    next_steps = {a.body.clock: a.body.steps[-1].index + 1 for a in answers if a.body.steps}
    if len(next_steps) > 1:
        label = Label(state=state)
        since = f"now on, since {len(next_steps)} input devices make steps"
    else:
        clock = next(iter(next_steps), answers[0].body.clock if len(answers) == 1 else "")
        label = Label(state=state, clock=clock, step=next_steps.get(clock, 0))
        since = f"step {label.step} on"
    deadline_s = time.monotonic() + HEARD_S
    while not labels.matching:
        if time.monotonic() > deadline_s:
            raise NobodyAnswersError("nobody writes it down: start a recorder")
        bus.pump(0.02)
    labels.put(label)
    bus.pump(0.05)
    return f"{plain(state) or 'nothing'} from {since}"
