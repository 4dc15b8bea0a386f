"""Operators at a fixture controller, with a clock of the test's own: 100 samples a second."""

from __future__ import annotations

from typing import Any

import numpy as np

from hmcs.fixtures.compliance.trust import SegmentBelief
from hmcs.fixtures.controller.controller import Controller
from hmcs.fixtures.controller.interface import Fixture, Guides, OperatorSample
from hmcs.fixtures.controller.rules import Rules, Safeguards
from hmcs.fixtures.regions.forbidden import Region
from hmcs.fixtures.regions.tool_shape import POINT, ToolShape
from hmcs.motion.paths import Path
from hmcs.task.fixture_parts import FixtureSetup, StateFixture

PERIOD_S = 0.01
REST = np.zeros(6)
AGREEING = np.array([0.1, 0.005, 0.0, 0.0, 0.0, 0.0])
"""A hand that goes along x, as far as hands do."""
FIRM = FixtureSetup().maximum_factor
"""The factor of a sure belief by default."""
ALONG_X = Path(np.array([[0.0, 0, 0], [0.5, 0, 0]]))
ALONG_Y = Path(np.array([[0.0, 0, 0], [0, 0.5, 0]]))
PATHS = {"x": ALONG_X, "y": ALONG_Y}
SURE = SegmentBelief(
    step=0,
    state="first",
    probability=1.0,
    gesteme="x",
    segment_start=0,
    unknown=0.0,
    unknown_alarm=False,
    complete=True,
)


def asking(**fixture: Any) -> Rules:
    """Rules of a task whose file says this of its fixture, and nothing else."""
    return Rules(FixtureSetup(**fixture))


class Session:
    """An operator at a controller: moves the hand, the clock and the recognizer."""

    def __init__(self, rules: Rules | None = None, paths: dict[str, Path] | None = None) -> None:
        self.controller = Controller(Safeguards())
        self.controller.load("m", Guides(PATHS if paths is None else paths, rules or Rules()))
        self.controller.activate("m")
        self.now_s = 10.0
        self.number = 0
        self.position = np.zeros(3)
        self.step = 0
        self.twist = AGREEING
        """Of the hand, where a call does not say otherwise."""

    def sample(
        self, twist: np.ndarray | None = None, dead_man: bool = True, clutch: bool = False
    ) -> Fixture:
        twist = self.twist if twist is None else twist
        self.now_s += PERIOD_S
        self.number += 1
        self.position = self.position + twist[:3] * PERIOD_S
        return self.controller.on_sample(
            self.now_s, OperatorSample(self.number, self.position, twist, dead_man, clutch)
        )

    def engage(self, twist: np.ndarray = REST) -> None:
        """Take hold with a hand that moves already; filters take it for one that always did."""
        self.sample(REST, dead_man=False)
        assert self.sample(twist).engaged

    def move(self, believed: bool = True, **belief: Any) -> Fixture:
        """Make a step and a sample, with a sure belief changed by `belief`."""
        before = self.position
        fixture = self.sample()
        self.controller.on_step(self.now_s, self.step, before, self.position - before, self.number)
        if believed:
            said = SURE._replace(step=self.step, **belief)
            self.controller.on_belief("m", said)
        self.step += 1
        return fixture

    def moves(self, count: int, believed: bool = True, **belief: Any) -> Fixture:
        fixture = self.move(believed, **belief)
        for _ in range(count - 1):
            fixture = self.move(believed, **belief)
        return fixture


class SessionWithRobot(Session):
    """A session with a robot that follows its commands."""

    def __init__(
        self,
        rules: Rules | None = None,
        regions: tuple[Region, ...] = (),
        tool: ToolShape = POINT,
    ) -> None:
        super().__init__(rules)
        self.controller.load("m", Guides(PATHS, rules or Rules(), regions, tool=tool))
        self.robot = np.zeros(3)

    def drive(self, twist: np.ndarray, ticks: int) -> np.ndarray:
        """Move the hand; return where the robot went, m, shape (ticks, 3)."""
        trail = []
        for _ in range(ticks):
            self.controller.robot_moved(self.now_s + PERIOD_S, self.robot)
            self.robot = self.robot + self.sample(twist).command_twist[:3] * PERIOD_S
            trail.append(self.robot)
        return np.array(trail)


class SessionOfState(SessionWithRobot):
    """A session whose only state, surely believed in, has a hard fixture of its own."""

    def __init__(self, **of_state: Any) -> None:
        own = StateFixture(**of_state)
        super().__init__(asking(maximum_factor=1.0).with_states({"first": own}))
        self.controller.robot_moved(self.now_s, self.robot)
        self.engage()
        # One step of the hand; then it may rest.
        self.controller.robot_moved(self.now_s, self.robot)
        self.controller.on_step(self.now_s, 0, np.zeros(3), np.array([0.01, 0, 0]), None)
        self.controller.on_belief("m", SURE)
