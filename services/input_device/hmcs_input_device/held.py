"""A handle on the operator's page as a device: smoothed, and let go of as soon as it is silent."""

from __future__ import annotations

import numpy as np

from hmcs.arrays import Array
from hmcs.bus.messages import Handle
from hmcs.task import Task
from hmcs_input_device.press_gate import SILENT_S, PressGate
from hmcs_input_device.settings import InputDeviceSettings
from hmcs_input_device.sources import FARTHEST_M, LIVE, DeviceSample

RATE_HZ = 100.0
FOLLOW_S = 0.08
"""Time constant with which the hand follows the handle: a page sends its place in jerks."""
FASTEST_M_S = 0.5
"""A handle that goes faster is followed no faster."""
JUMP_M = 2.0
"""A handle that goes farther from one message to the next was not moved there by a hand."""


class HeldHandle:
    """The hand that holds a page's handle, one operator at a time.

    The hand is its own integral: where the handle is pressed anew, the hand does not jump there. A
    page that closes, hangs or is cut off is silent: the dead-man is up until its operator is seen
    to let go and to take hold anew. So it is after a page's handle jumped, and where a page was
    first heard while its handle was held.
    """

    rate_hz = RATE_HZ
    duration_s = LIVE
    reach_m = None

    def __init__(self) -> None:
        self._gate = PressGate("the handle")
        self._handle: Handle | None = None
        self._heard_s = -float("inf")
        self._let_go = False
        self._fault = ""
        self._hand = np.zeros(3)
        self._offset: Array | None = None
        self._sampled_s: float | None = None
        self._elapsed_s = 0.0
        self.refusal = ""
        """Why the last handle was refused."""

    @property
    def trouble(self) -> str:
        """Why nothing moves, and what to do; empty while all is well."""
        return self._gate.trouble

    def handled(self, now_s: float, handle: Handle) -> bool:
        """Take in what a page says; False where it is refused, see `refusal`."""
        before = self._handle
        another = before is None or handle.operator != before.operator
        self.refusal = ""
        if another and self._holds(now_s):
            self.refusal = f"{handle.operator!r} does not operate: another page holds the handle"
        elif not np.abs(handle.position).max() <= FARTHEST_M:
            self.refusal = f"{handle.operator!r} sends a handle farther than {FARTHEST_M:g} m"
            if not another:
                self._fault = f"the page {handle.operator!r} sends a handle out of reach"
        if self.refusal:
            return False
        if not handle.dead_man:
            self._let_go = True
        elif another:
            self._fault = f"the page {handle.operator!r} held its handle when it was first heard"
        elif before is not None and before.dead_man and _jumped(before, handle):
            self._fault = f"the handle of the page {handle.operator!r} jumped"
        if another or not handle.dead_man or handle.clutch:
            self._offset = None
        self._handle, self._heard_s = handle, now_s
        return True

    def seconds(self, now_s: float) -> None:
        """Set the time of the next sample, by the clock of `handled`."""
        elapsed_s = 0.0 if self._sampled_s is None else max(now_s - self._sampled_s, 0.0)
        self._sampled_s = now_s
        self._elapsed_s = min(elapsed_s, FOLLOW_S)

    def sample(self, elapsed_s: float | None) -> DeviceSample:
        """Return the hand now; at rest, with the dead-man up, while nobody holds the handle."""
        now_s, handle = self._sampled_s, self._handle
        if now_s is None or handle is None:
            return DeviceSample(self._hand, np.zeros(3), dead_man=False)
        trouble, self._fault = self._fault, ""
        if not trouble and handle.dead_man and not self._holds(now_s):
            trouble = f"the page {handle.operator!r} fell silent while its handle was held"
        # Let go of and taken hold of anew between two samples, it was let go of all the same.
        pressed, self._let_go = handle.dead_man and not self._let_go, False
        remedy = ": let go of the handle and take hold of it anew" if trouble else ""
        if not self._gate.passes(now_s, pressed, trouble + remedy):
            self._offset = None
            pedal = handle.pedal and not trouble
            return DeviceSample(self._hand, np.zeros(3), dead_man=False, pedal=pedal)
        if self._offset is None:
            self._offset = self._hand - handle.position
        wanted = (handle.position + self._offset - self._hand) / FOLLOW_S
        speed = float(np.linalg.norm(wanted))
        velocity = wanted * min(1.0, FASTEST_M_S / speed) if speed > 0 else wanted
        hand = self._hand + velocity * self._elapsed_s
        self._hand = np.clip(hand, -FARTHEST_M, FARTHEST_M)
        return DeviceSample(
            self._hand, velocity, dead_man=True, clutch=handle.clutch, pedal=handle.pedal
        )

    def close(self) -> None:
        """Nothing is held."""

    def _holds(self, now_s: float) -> bool:
        handle = self._handle
        return handle is not None and handle.dead_man and abs(now_s - self._heard_s) <= SILENT_S


def _jumped(before: Handle, handle: Handle) -> bool:
    return bool(np.linalg.norm(handle.position - before.position) > JUMP_M)


def page(settings: InputDeviceSettings, task: Task) -> HeldHandle:
    """Return a source that is the handle of the operator's page."""
    del settings, task
    return HeldHandle()
