"""What reaches a fixture controller: of one input device and one robot, in order, and no older.

The service lets live messages through it and a replay recorded ones, so that both give the
controller the same.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Collection
from typing import Literal

from hmcs.bus.counters import Sequences
from hmcs.bus.messages import Belief, Motion, Origin, RobotState, Source, Step
from hmcs.driving import Device, FollowingRobot, heard_device, heard_robot
from hmcs.fixtures.controller.controller import Controller
from hmcs.fixtures.controller.interface import Fixture, Guides
from hmcs.translation import sample_of, segment_belief_of

Verdict = Literal["taken", "second", "old", "early", "other_clock"]
"""`second` is of another device or robot than the one paired, `old` no newer than what was taken,
`early` waits for its step, `other_clock` speaks of another device's steps."""

EARLY_WITHIN = 64
"""A belief may overtake the step it is of by so few."""
EARLY_KEPT = 64
"""Recognizers whose early belief is kept."""


class ControllerFeed:
    """Lets messages through to a controller; times are s of one monotonic clock."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.device = Device()
        self.robot = FollowingRobot()
        self.clock = ""
        """Boot of the device whose steps count."""
        self._begin_orders()

    def load(self, name: str, guides: Guides) -> None:
        """Make a recognizer known, instead of another of that name and what that one believed."""
        self._early.pop(name, None)
        self.controller.load(name, guides)

    def unload(self, name: str) -> None:
        """Forget a recognizer and what it believed, unless it is the active one."""
        if name != self.controller.active:
            self._early.pop(name, None)
        self.controller.unload(name)

    def on_motion(
        self, now_s: float, source: Source, seq: int, motion: Motion, origin: Origin | None
    ) -> Fixture | None:
        """Take in sample `seq` and return what to do now; None where another device drives."""
        self.device = heard_device(
            self.device, now_s, source.boot, source.instance, pressed=motion.dead_man
        )
        if self.device.boot != source.boot:
            return None
        if source.boot != self.clock:
            self._begin(now_s, source.boot)
        return self.controller.on_sample(now_s, sample_of(motion, seq, origin))

    def on_step(self, now_s: float, source: Source, step: Step, origin: Origin | None) -> Verdict:
        """Take in a step, and the beliefs that had come before it."""
        if self.device.boot and source.boot != self.device.boot:
            return "second"
        if source.boot != self.clock:
            self._begin(now_s, source.boot)
        if self._steps.note("step", self.clock, step.index) is None:
            return "old"
        self._newest = step.index
        number = None if origin is None else origin.seq
        self.controller.on_step(now_s, step.index, step.position, step.displacement, number)
        for name in [n for n, belief in self._early.items() if belief.step <= self._newest]:
            self._believe(name, self._early.pop(name))
        return "taken"

    def on_belief(self, name: str, belief: Belief) -> Verdict:
        """Take in what the recognizer `name` believes.

        Raises ValueError for a belief that contradicts itself, UnknownModelError where the
        recognizer is not loaded.
        """
        if belief.clock != self.clock:
            return "other_clock"
        segment_belief_of(belief)
        if belief.step > self._newest:
            if belief.step > self._newest + EARLY_WITHIN:
                return "old"
            self._early[name] = belief
            while len(self._early) > EARLY_KEPT:
                self._early.popitem(last=False)
            return "early"
        return self._believe(name, belief)

    def on_robot(
        self, now_s: float, source: Source, state: RobotState, present: Collection[str]
    ) -> Verdict:
        """Take in where a robot is; `present` are the robots that show a presence token."""
        before = self.robot.boot
        self.robot = heard_robot(self.robot, now_s, source.boot, source.instance, present)
        if self.robot.boot != before and before:
            self.controller.begin_robot()
        if self.robot.boot != source.boot:
            return "second"
        self.controller.robot_moved(now_s, state.tool_position, state.tool_orientation)
        return "taken"

    def _believe(self, name: str, belief: Belief) -> Verdict:
        if self._beliefs.note(name, self.clock, belief.step) is None:
            return "old"
        self.controller.on_belief(name, segment_belief_of(belief))
        return "taken"

    def _begin(self, now_s: float, clock: str) -> None:
        self.clock = clock
        self._begin_orders()
        released = clock == self.device.boot and self.device.deliberate
        self.controller.begin_device(now_s, released)

    def _begin_orders(self) -> None:
        self._steps, self._beliefs = Sequences(), Sequences()
        self._newest = -1
        self._early: OrderedDict[str, Belief] = OrderedDict()
