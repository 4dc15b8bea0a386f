"""A device that is where a test says, and how a test presses its dead-man."""

from __future__ import annotations

from typing import Any

import numpy as np

from hmcs_input_device.sources import LIVE, DeviceSample


class Hand:
    """A device whose samples a test sets."""

    rate_hz, duration_s, reach_m = 200.0, LIVE, None

    def __init__(self) -> None:
        self.says: DeviceSample | None = DeviceSample(np.zeros(3), np.zeros(3), dead_man=False)
        self.closed = False

    def move(self, x_m: float, **fields: Any) -> None:
        position = np.array([x_m, 0.0, 0.0])
        self.says = DeviceSample(position, np.zeros(3), **({"dead_man": True} | fields))

    def sample(self, elapsed_s: float | None) -> DeviceSample | None:
        return self.says

    def close(self) -> None:
        self.closed = True


def seen(desk: Any) -> None:
    """Pump until what the device says now was published."""
    count = len(desk.motions)
    desk.until(lambda: len(desk.motions) > count + 3, "the device to be seen")


def press(desk: Any, hand: Hand, **fields: Any) -> None:
    """Let go and press."""
    for dead_man in (False, True):
        hand.move(0.0, dead_man=dead_man, **fields)
        seen(desk)
    assert desk.motions[-1].body.dead_man
