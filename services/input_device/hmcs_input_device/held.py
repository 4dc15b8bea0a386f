"""A handle on the operator's page as a device: smoothed, and let go of as soon as it is silent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hmcs.bus.messages import Handle
from hmcs.task import Task
from hmcs_input_device.settings import InputDeviceSettings
from hmcs_input_device.sources import LIVE, DeviceSample

FloatArray = NDArray[np.float64]

RATE_HZ = 100.0
SILENT_S = 0.15
"""A page that says nothing for so long has closed, hangs or is cut off: the dead-man is up."""
FOLLOW_S = 0.08
"""Time constant with which the hand follows the handle: a page tells its place in jerks."""
FASTEST_M_S = 0.5
"""A handle that jumps is followed no faster."""


class HeldHandle:
    """The hand that holds a page's handle, one operator at a time.

    The hand is its own integral: where the handle is pressed anew, the hand does not jump there.
    """

    rate_hz = RATE_HZ
    duration_s = LIVE
    reach_m = None

    def __init__(self) -> None:
        self._operator = ""
        self._handle: Handle | None = None
        self._heard_s = -float("inf")
        self._hand = np.zeros(3)
        self._offset: FloatArray | None = None
        self._sampled_s: float | None = None
        self._elapsed_s = 0.0

    def handled(self, now_s: float, handle: Handle) -> bool:
        """Take in what a page says; False where another operator's page holds the lease."""
        another = handle.operator != self._operator
        if another and self._operator and self._holds(now_s):
            return False
        if another or not handle.dead_man or handle.clutch:
            self._offset = None
        self._operator, self._handle, self._heard_s = handle.operator, handle, now_s
        return True

    def seconds(self, now_s: float) -> None:
        """Be told the time of the next sample, by the clock of `handled`."""
        elapsed_s = 0.0 if self._sampled_s is None else max(now_s - self._sampled_s, 0.0)
        self._sampled_s = now_s
        self._elapsed_s = min(elapsed_s, 0.1)

    def sample(self, elapsed_s: float | None) -> DeviceSample:
        """Return the hand now; at rest, with the dead-man up, while nobody holds the handle."""
        now_s, handle = self._sampled_s, self._handle
        if now_s is None or handle is None or not self._holds(now_s):
            self._offset = None
            pedal = handle is not None and handle.pedal
            return DeviceSample(self._hand, np.zeros(3), dead_man=False, pedal=pedal)
        if self._offset is None:
            self._offset = self._hand - handle.position
        wanted = (handle.position + self._offset - self._hand) / FOLLOW_S
        speed = float(np.linalg.norm(wanted))
        velocity = wanted * min(1.0, FASTEST_M_S / speed) if speed > 0 else wanted
        self._hand = self._hand + velocity * min(self._elapsed_s, FOLLOW_S)
        return DeviceSample(
            self._hand, velocity, dead_man=True, clutch=handle.clutch, pedal=handle.pedal
        )

    def close(self) -> None:
        """Nothing is held."""

    def _holds(self, now_s: float) -> bool:
        handle = self._handle
        return handle is not None and handle.dead_man and now_s - self._heard_s <= SILENT_S


def page(settings: InputDeviceSettings, task: Task) -> HeldHandle:
    """Return a source that is the handle of the operator's page."""
    del settings, task
    return HeldHandle()
