"""`hmcs mark`: what the operator says of the motion while it is made."""

from __future__ import annotations

import time

from hmcs.bus.keys import ANY
from hmcs.bus.messages import Label, LastSteps, LastStepsQuestion
from hmcs.bus.session import Bus
from hmcs_local.asking import NobodyAnswersError

HEARD_S = 1.0
"""So long is waited for somebody who writes it down."""


def mark(bus: Bus, state: str) -> str:
    """Say that the hand is in `state` from its next step on; return what was said.

    Raises NobodyAnswersError where nobody listens.
    """
    labels = bus.publisher(Label, bus.keys.label)
    key = bus.keys.rpc("input_device", ANY, "last_steps")
    clock, step = "", 0
    for answer in bus.ask(key, LastStepsQuestion(count=1), LastSteps)[:1]:
        clock = answer.body.clock
        step = answer.body.steps[-1].index + 1 if answer.body.steps else 0
    deadline_s = time.monotonic() + HEARD_S
    while not labels.matching:
        if time.monotonic() > deadline_s:
            raise NobodyAnswersError("nobody writes it down: start a recorder")
        bus.pump(0.02)
    labels.put(Label(state=state, clock=clock, step=step))
    bus.pump(0.05)
    return f"{state or 'nothing'} from step {step} on"
