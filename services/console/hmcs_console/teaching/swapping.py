"""Which recognizer is followed: a newcomer takes over, the one before comes back."""

from __future__ import annotations

import time
from collections.abc import Callable

from hmcs.recognizer_takeover import NOTHING_COMPARED, Question, activate
from hmcs_console.asking import first_of
from hmcs_console.seeing.seen import Seen
from hmcs_console.teaching import takeover
from hmcs_console.teaching.takeover import Advance, Followed, Takeover

Notify = Callable[[str], None]


class Swapping:
    """Carries takeovers out, one at a time; called on the bus' own thread."""

    def __init__(
        self, seen: Seen, request: Callable[[Question, Notify, Notify], None], compare_s: float
    ) -> None:
        """Ask with `request`: of a question, what to call with its answer, and what to call with
        the reason why it was not carried out."""
        self._seen = seen
        self._request = request
        self._compare_s = compare_s
        self._takeover: Takeover | None = None
        self._followed = Followed()

    def take_over(self) -> None:
        """Have the fixture follow what was trained last, once it was compared."""
        if self._takeover is None or not self._takeover.under_way:
            active = self._seen.active(time.monotonic())
            self._advance(takeover.begun(self._seen.training, active))

    def activate_now(self) -> None:
        """Have the fixture follow the newcomer without comparing it any longer."""
        if self._takeover is not None:
            self._advance(takeover.hurried(self._takeover))

    def back(self) -> None:
        """Have the fixture follow who was active before; one that only runs beside is let be."""
        now = self._takeover
        if now is not None and now.under_way:
            self._advance(takeover.called_off(now))
        elif self._followed.before:
            question = activate(self._followed.before)
            self._request(question, self._tell, self._tell)
        else:
            self._tell("no other recognizer was active before")

    def watch(self) -> None:
        """See how the newcomer does."""
        now_s, members = time.monotonic(), self._seen.members
        active = self._seen.active(now_s)
        self._followed = takeover.followed(self._followed, active)
        self._seen.before = self._followed.before
        if self._takeover is not None and self._takeover.under_way:
            agreed = self._seen.agreement(active).get(self._takeover.model, NOTHING_COMPARED)
            there = first_of("recognizer", members) is not None
            self._advance(takeover.at(self._takeover, now_s, agreed, there=there))
        self._seen.takeover = takeover.said(self._takeover, now_s)

    def _advance(self, advance: Advance) -> None:
        self._takeover = advance.takeover
        if advance.ask is not None:
            self._request(advance.ask, self._answered, self._refused)

    def _answered(self, detail: str) -> None:
        if self._takeover is not None:
            now_s = time.monotonic()
            self._advance(takeover.answered(self._takeover, detail, now_s, self._compare_s))
            if self._takeover.stage == "comparing":
                # What an earlier recognizer of its name said is nothing of the newcomer's.
                self._seen.forget(self._takeover.model)

    def _refused(self, reason: str) -> None:
        if self._takeover is not None:
            self._advance(takeover.refused(self._takeover, reason))

    def _tell(self, what: str) -> None:
        self._seen.answer = what
