"""A source that closes the loop: a simulated operator who sees the robot, late, and steers it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hmcs.motion.closed_loop_operators import ClosedLoopOperator
from hmcs_input_device.reaction import Reaction
from hmcs_input_device.sources import LIVE, DeviceSample

FloatArray = NDArray[np.float64]

MOST_BEHIND = 10
"""A process that hung makes up for so many samples at most; the operator waited meanwhile."""


class Simulated:
    """One performance by a `ClosedLoopOperator`.

    The hand rests with the dead-man released before it and after it, and while nobody knows where
    the robot is.
    """

    def __init__(
        self,
        operator: ClosedLoopOperator,
        *,
        rate_hz: float,
        lead_in_s: float,
        reach_m: float,
        reaction: Reaction | None = None,
    ) -> None:
        self._operator = operator
        self._lead_in_s = lead_in_s
        self._robot: FloatArray | None = None
        self._hand = np.zeros(3)
        self._made = 0
        self._ended_s: float | None = None
        self.rate_hz = rate_hz
        self.reach_m = reach_m
        self.reaction = reaction

    @property
    def duration_s(self) -> float:
        """When it arrived; LIVE until then."""
        return LIVE if self._ended_s is None else self._ended_s

    def sees(self, position: FloatArray) -> None:
        """Take in where the robot's tool is, m, base frame, shape (3,)."""
        self._robot = position

    def sample(self, elapsed_s: float | None) -> DeviceSample:
        """Return the hand `elapsed_s` after it was told to begin; one period of motion a call."""
        resting = DeviceSample(self._hand, np.zeros(3), dead_man=False)
        if elapsed_s is None or elapsed_s < self._lead_in_s or self._ended_s is not None:
            return resting
        if self._robot is None:
            self._lead_in_s = elapsed_s
            return resting
        if self.reaction is not None and self.reaction.lets_go(elapsed_s, pressing=True):
            self._made = self._due(elapsed_s)
            return resting
        due = self._due(elapsed_s)
        self._made = max(self._made, due - MOST_BEHIND)
        velocity = np.zeros(3)
        while self._made < due:
            motion = self._operator.step(self._robot)
            self._made += 1
            if motion.arrived:
                self._ended_s = elapsed_s
                return resting
            velocity = motion.velocity
            self._hand = self._hand + velocity / self.rate_hz
        return DeviceSample(self._hand, velocity, dead_man=True)

    def close(self) -> None:
        """Nothing is held."""

    def _due(self, elapsed_s: float) -> int:
        return round((elapsed_s - self._lead_in_s) * self.rate_hz) + 1
