"""One rule for every dead-man's switch: after any trouble only a deliberate new press counts."""

from __future__ import annotations

from typing import Literal

SILENT_S = 0.15
"""A device whose newest report is older has fallen silent, where it should report all the time."""
HANG_S = 0.1
"""Two samples farther apart: this process hung, or its clock jumped, and the others stopped on it.
As long as fixture controller and robot wait for a sample."""
SETTLE_S = 0.25
"""What is seen so soon after a hang may have queued up in it and be old."""


class PressGate:
    """Lets a press through only once the switch was seen released since the last trouble.

    It begins shut, so that a switch which is held when the process comes up moves nothing. Trouble
    shuts it: a device that is silent, gone or sends nonsense, and a hang of this process. It opens
    when the switch is seen released and then pressed, both without trouble.
    """

    def __init__(self, switch: str, *, minds_hangs: bool = True) -> None:
        """Guard the switch that people call `switch`.

        `minds_hangs` is False for a source that plays: its own time stands still in a hang.
        """
        self._switch = switch
        self._minds_hangs = minds_hangs
        self._state: Literal["shut", "released", "open"] = "shut"
        self._cause = "it was held when it was first seen"
        self._trouble = ""
        self._seen_s: float | None = None
        self._settled_s = -float("inf")

    @property
    def trouble(self) -> str:
        """Why a press does not count, and what to do; empty while it would."""
        return self._trouble

    @property
    def open(self) -> bool:
        """Whether the last press came through."""
        return self._state == "open"

    def shut(self, cause: str) -> None:
        """Let nothing through until the switch was released and pressed anew."""
        self._state, self._cause, self._trouble = "shut", cause, ""

    def passes(self, now_s: float, pressed: bool, trouble: str = "") -> bool:
        """Return whether the switch counts as pressed at `now_s`.

        `trouble` says why it cannot be trusted now, and what to do; empty where it can.
        """
        before_s, self._seen_s = self._seen_s, now_s
        if self._minds_hangs and before_s is not None and not 0.0 <= now_s - before_s <= HANG_S:
            self._settled_s = now_s + SETTLE_S
            self.shut("this process hung or its clock jumped")
        if trouble:
            self.shut(trouble.rpartition(":")[0] or trouble)
            self._trouble = trouble
            return False
        self._trouble = ""
        if not pressed:
            if self._state == "open" or now_s >= self._settled_s:
                self._state = "released"
            return False
        if self._state == "shut":
            self._trouble = (
                f"{self._switch} is held since before it counted ({self._cause}), so that nothing "
                "moves: let go of it and press it anew"
            )
            return False
        self._state = "open"
        return True
