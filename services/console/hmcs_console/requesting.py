"""What is asked of a kind of process: of the first one that is there, once it can be done."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

from hmcs.bus.messages import ActivateRecognizer
from hmcs.bus.session import Bus
from hmcs.recognizer_takeover import Question
from hmcs_console.asking import Asking, first_of
from hmcs_console.seeing.seen import Seen

RUN_WITHIN_S = 2.0
"""A recognizer that is to be activated has so long to be run by some process."""
_AGAIN_NS = 50_000_000

Notify = Callable[[str], None]


class Requesting:
    """Asks; called on the bus' own thread."""

    def __init__(self, bus: Bus, seen: Seen, asking: Asking) -> None:
        self._bus = bus
        self._seen = seen
        self._asking = asking

    def request(self, question: Question, done: Notify, failed: Notify) -> None:
        """Have a process do something; tell in one line what came of it, or why it was not done.

        A recognizer that no process runs is not activated: the fixture would wait for its beliefs.
        """
        if isinstance(question.body, ActivateRecognizer):
            until_s = time.monotonic() + RUN_WITHIN_S
            self._activate(question, question.body.model, done, failed, until_s)
        else:
            self._ask(question, done, failed)

    def _activate(
        self, question: Question, model: str, done: Notify, failed: Notify, until_s: float
    ) -> None:
        if self._seen.runners.run(model, self._seen.members):
            self._ask(question, done, failed)
        elif time.monotonic() >= until_s:
            failed(
                f"{model} is not activated: no process that is there runs it. Start one, e.g. a "
                "recognizer with its model, or activate another"
            )
        else:
            # One that was loaded just now shows its token in a moment.
            again = partial(self._activate, question, model, done, failed, until_s)
            self._bus.at(time.monotonic_ns() + _AGAIN_NS, again)

    def _ask(self, question: Question, done: Notify, failed: Notify) -> None:
        member = first_of(question.service, self._seen.members)
        if member is None:
            failed(f"no {question.service} is there to {question.verb.name}: start one")
        else:
            self._asking.request(member, question.verb, question.body, done, failed)
