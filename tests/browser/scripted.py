"""A hand by script: it tells what the page would tell of its handle.

By mouse a demonstration would take minutes on a page without graphics hardware.
"""

from __future__ import annotations

import time
from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hmcs.bus.messages import Handle, Label, Step
from hmcs.bus.session import Received
from support.stack import Stack

TELL_S = 0.02
LET_GO_S = 0.1
"""So long handle and pedal are up before they are held and pressed again."""
LONGEST_PRESS_S = 5.0
BEHIND_S = 0.08
"""The hand follows its handle so much later."""


class Scripted:
    """Whoever holds the handle: goes its way, and presses the pedal where a part begins."""

    def __init__(
        self,
        stack: Stack,
        corners_m: NDArray[np.float64],
        states: Sequence[str],
        speed_m_s: float,
    ) -> None:
        """Go from corner to corner, m, base frame, shape (S + 1, 3), through one of S states each.

        An empty state is no part of the task: the pedal ends it there.
        """
        self._stack = stack
        # Of its own: what others on a bus have not handled yet holds up labels and steps.
        bus = stack.open_bus("observer", "hand")
        self._corners_m, self._states, self._speed_m_s = corners_m, states, speed_m_s
        self._handles = bus.publisher(Handle, bus.keys.handle)
        self.steps: list[Received[Step]] = []
        self._marks = 0
        bus.subscribe(Step, bus.keys.step, self.steps.append)
        bus.subscribe(Label, bus.keys.label, self._on_label)

    def perform(
        self, rng: np.random.Generator, *, mark: bool, parts: int | None = None
    ) -> dict[int, str]:
        """Go once, through so many parts or all; return the state that is meant at each step.

        The pedal is down until what it marks was said, which takes a movement. Nothing is returned
        where the machine stood still for so long that the device had the hand rest: go again.
        """
        first_m = self._corners_m[0]
        corners_m = self._corners_m[: None if parts is None else parts + 1]
        corners = first_m + (corners_m - first_m) * rng.uniform(0.95, 1.05)
        sides_m = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        ends_s = np.cumsum(sides_m) / self._speed_m_s
        self._tell(corners[0], held=False)
        # Taken hold of in the same moment it would not be seen to have been let go.
        self._stack.elapse(LET_GO_S)
        first, begins, turns = len(self.steps), list[int](), [0.0, *ends_s[:-1] + BEHIND_S]
        began_s, marked, pedal, down_s = time.monotonic(), self._marks, False, -LET_GO_S
        while (at_s := time.monotonic() - began_s) < ends_s[-1] + BEHIND_S or pedal:
            if at_s > ends_s[-1] + LONGEST_PRESS_S:
                self._tell(corners[-1], held=False)
                return {}
            down_s = at_s if pedal else down_s
            pedal = mark and self._marks - marked < len(begins)
            up = not pedal and at_s - down_s >= LET_GO_S
            if up and len(begins) < len(turns) and at_s >= turns[len(begins)]:
                begins.append(self._next)
                pedal = mark
            share = [np.interp(at_s, [0.0, *ends_s], axis) for axis in corners.T]
            self._tell(np.array(share), held=True, pedal=pedal)
            self._stack.elapse(TELL_S)
        self._tell(corners[-1], held=False)
        # What has been made meanwhile is still on its way.
        self._stack.elapse(0.2)
        made = [step.body.index for step in self.steps[first:]]
        return {index: self._states[bisect_right(begins, index) - 1] for index in made}

    def _on_label(self, _: Received[Label]) -> None:
        self._marks += 1

    @property
    def _next(self) -> int:
        return self.steps[-1].body.index + 1 if self.steps else 0

    def _tell(self, position: NDArray[np.float64], *, held: bool, pedal: bool = False) -> None:
        self._handles.put(Handle(operator="script", position=position, dead_man=held, pedal=pedal))
