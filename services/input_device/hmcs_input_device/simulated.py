"""A source that closes the loop: a simulated operator who sees the robot, late, and steers it."""

from __future__ import annotations

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.closed_loop_operators import ClosedLoopOperator
from hmcs.motion.hand_guiding import HandGuiding
from hmcs_input_device.reaction import HEARD_WITHIN_S, Reaction
from hmcs_input_device.sources import LIVE, DeviceSample

MOST_BEHIND = 10
"""A process that hung makes up for so many samples at most; the operator waited meanwhile."""


class Simulated:
    """One performance by a `ClosedLoopOperator`, with a hand of their own or on the robot's tool.

    The hand rests with the dead-man released before it and after it, and while nobody knows where
    the robot is: before it was heard, and when it has been silent.
    """

    plays = True

    def __init__(
        self,
        operator: ClosedLoopOperator,
        *,
        rate_hz: float,
        lead_in_s: float,
        reach_m: float,
        reaction: Reaction | None = None,
        hand_guiding: HandGuiding | None = None,
    ) -> None:
        """Be asked `rate_hz` times a second, and rest for `lead_in_s` before the hand moves.

        With `hand_guiding` the hand is where the tool is, and its velocity is the one its force
        asks for.
        """
        self._operator = operator
        self._lead_in_s = lead_in_s
        self._robot: tuple[Array, Array] | None = None
        self._seen_anew = False
        self._seen_s = 0.0
        self._hand_guiding = hand_guiding
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

    def sees(self, position: Array, orientation: Array) -> None:
        """Take in the robot's tool, base frame: position, m, (3,), and how it is turned, (4,)."""
        self._robot, self._seen_anew = (position, orientation), True
        if self._hand_guiding is not None:
            self._hand = position

    def sample(self, elapsed_s: float | None) -> DeviceSample:
        """Return the hand `elapsed_s` after the request to begin; one period of motion a call."""
        resting = DeviceSample(self._hand, np.zeros(3), dead_man=False)
        if elapsed_s is None or elapsed_s < self._lead_in_s or self._ended_s is not None:
            return resting
        if self._robot is None:
            self._lead_in_s = elapsed_s
            return resting
        if self._unseen(elapsed_s):
            self._made = self._due(elapsed_s)
            return resting
        if self.reaction is not None and self.reaction.lets_go(elapsed_s, pressing=True):
            self._made = self._due(elapsed_s)
            return resting
        due = self._due(elapsed_s)
        self._made = max(self._made, due - MOST_BEHIND)
        velocity, wrench = np.zeros(3), None
        tool, orientation = self._robot
        while self._made < due:
            motion = self._operator.step(tool)
            self._made += 1
            if motion.arrived:
                self._ended_s = elapsed_s
                return resting
            velocity = motion.velocity
            if self._hand_guiding is None:
                self._hand = self._hand + velocity / self.rate_hz
            else:
                led = self._hand_guiding.push(velocity, orientation, 1.0 / self.rate_hz)
                velocity, wrench = led.twist[:3], led.wrench
        return DeviceSample(self._hand, velocity, dead_man=True, wrench=wrench)

    def close(self) -> None:
        """Nothing is held."""

    def _unseen(self, elapsed_s: float) -> bool:
        """Whether the robot was not seen for so long that nobody knows where it is."""
        if self._seen_anew:
            self._seen_anew, self._seen_s = False, elapsed_s
        return elapsed_s - self._seen_s > HEARD_WITHIN_S

    def _due(self, elapsed_s: float) -> int:
        return round((elapsed_s - self._lead_in_s) * self.rate_hz) + 1
