"""Which input device drives: one at a time, and none of its samples twice or out of order."""

from __future__ import annotations

from typing import Literal

Verdict = Literal["accepted", "second_device", "old"]


class Driver:
    """Knows the device that drives by its boot; another takes over once this one is silent."""

    def __init__(self, silent_after_s: float) -> None:
        self._silent_after_s = silent_after_s
        self._boot = ""
        self._seq = -1
        self._heard_s = -float("inf")

    def heard(self, now_s: float, boot: str, seq: int) -> Verdict:
        """Judge sample `seq` of the device with that boot; an accepted one makes it the driver."""
        if not self.admits(now_s, boot):
            return "second_device"
        if boot == self._boot and seq <= self._seq:
            return "old"
        self._boot, self._seq, self._heard_s = boot, seq, now_s
        return "accepted"

    def admits(self, now_s: float, boot: str) -> bool:
        """Whether what this device says counts: it drives, or nobody does."""
        return boot == self._boot or now_s - self._heard_s > self._silent_after_s
