"""`hmcs mark`: what the operator says of the motion while it is made."""

from __future__ import annotations

import time

from hmcs.bus.messages import Label, LastStepsQuestion
from hmcs.bus.session import Bus
from hmcs.bus.verbs import LAST_STEPS
from hmcs.shown import plain
from hmcs_local.asking import NobodyAnswersError

HEARD_S = 1.0
"""So long is waited for somebody who writes it down."""


def mark(bus: Bus, state: str) -> str:
    """Say that the hand is in `state` from its next step on; return what was said.

    Where several input devices make steps it is said from this moment on: which of them is the hand
    cannot be known. Raises NobodyAnswersError where nobody listens.
    """
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
