"""Arms led by their joints, simulated with the delay of what they say of themselves."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hmcs.arms.chain import Chain, chain_of, pose_of
from hmcs.arms.urdf import urdf_in
from hmcs.errors import UserError
from hmcs.fixtures.regions.forbidden import Plane, Region
from hmcs.motion.quaternions import between
from hmcs.task import load_task
from hmcs_ros2_bridge.arm_state import ArmReport
from hmcs_ros2_bridge.leading import (
    HELD_FOR_NS,
    JointLeading,
    JointSpeech,
    TrajectorySpeech,
    VelocitySpeech,
    joint_leading_of,
)
from hmcs_ros2_bridge.robot_settings import RosRobotSettings
from hmcs_ros2_bridge.tool_limits import fence_of, tool_limits_of
from support.urdfs import arm

TASK = load_task("human-shapes")
PERIOD_S, DELAY_S = 0.01, 0.1
CHAIN = chain_of(urdf_in(Path("arm.urdf"), arm().encode()), "tool")
BENT = np.array([0.1, 0.4, 0.7, 0.2, 0.6, 0.1])
SPAN_S = 0.05
Say = Callable[[Chain], JointSpeech]


def trajectory(chain: Chain) -> JointSpeech:
    return TrajectorySpeech(chain, SPAN_S)


class Rig:
    """An arm that does exactly what it is told, `DELAY_S` later, and says so."""

    def __init__(
        self, say: Say = VelocitySpeech, regions: tuple[Region, ...] = (), room_m: float = 5.0
    ) -> None:
        self.at = BENT
        self.start = pose_of(CHAIN.poses(BENT))
        limits = replace(
            tool_limits_of(TASK, DELAY_S, 2.0, 10.0),
            workspace_lower_m=self.start.position - room_m,
            workspace_upper_m=self.start.position + room_m,
        )
        fence = replace(fence_of(TASK, limits), regions=regions)
        self.limits = limits
        self.leading = JointLeading(CHAIN, limits, fence, DELAY_S, say(CHAIN))
        self._told = deque([BENT] * round(DELAY_S / PERIOD_S))
        self.names: set[str] = set()

    def report(self) -> ArmReport:
        at = self._told[0]
        return ArmReport(pose_of(CHAIN.poses(at)), np.zeros(6), 0.0, 0, at)

    def lead(self, twist: Any, periods: int = 1) -> Any:
        """Lead on for so long; return the last message."""
        for _ in range(periods):
            led = self.leading.led(np.array(twist, dtype=float), self.report(), PERIOD_S, 0)
            self.names |= set(led.names)
            assert led.message is not None
            self._do(led.message)
        return led.message

    def _do(self, message: Any) -> None:
        if "data" in message:
            self.at = self.at + np.array(message["data"]) * PERIOD_S
        else:  # half of the way to a point that is to be reached after the double time
            point = np.array(message["points"][0]["positions"])
            self.at = self.at + (point - self.at) * PERIOD_S / SPAN_S
        self._told.popleft()
        self._told.append(self.at)

    def moved(self) -> np.ndarray:
        """Return how far the tool is from the start: m and rad, shape (6,)."""
        now = pose_of(CHAIN.poses(self.at))
        turned = between(self.start.orientation, now.orientation)
        return np.concatenate([now.position - self.start.position, turned])


@pytest.mark.parametrize("say", [VelocitySpeech, trajectory])
@pytest.mark.parametrize("twist", [[0.05, -0.04, 0.03, 0, 0, 0], [0, 0, 0, 0.1, 0.2, -0.1]])
def test_the_tool_goes_as_it_is_commanded(say: Say, twist: list[float]) -> None:
    rig = Rig(say)
    rig.lead(twist, 20)
    before = rig.moved()
    rig.lead(twist, 100)
    # Late by its delay the arm has the Jacobian of a moment ago.
    np.testing.assert_allclose(rig.moved() - before, np.array(twist), atol=5e-3)


@settings(max_examples=60)
@given(
    arrays(float, 6, elements=st.floats(-1e3, 1e3)),
    arrays(float, 6, elements=st.floats(-2.79, 2.79)),
)
def test_no_joint_and_no_tool_is_faster_than_its_limit(twist: np.ndarray, at: np.ndarray) -> None:
    rig = Rig()
    report = ArmReport(pose_of(CHAIN.poses(at)), np.zeros(6), 0.0, 0, at)
    for _ in range(30):
        led = rig.leading.led(twist, report, PERIOD_S, 0)
    assert led.message is not None
    velocities = np.array(led.message["data"])
    assert (np.abs(velocities) <= CHAIN.limits.speed * (1 + 1e-9)).all()
    tool = CHAIN.jacobians(at) @ velocities
    assert np.linalg.norm(tool[:3]) <= rig.limits.speed_m_s * (1 + 1e-6)
    assert np.linalg.norm(tool[3:]) <= rig.limits.angular_speed_rad_s * (1 + 1e-6)


@pytest.mark.parametrize("say", [VelocitySpeech, trajectory])
@pytest.mark.parametrize("turning", [-0.5, 0.5])
def test_a_late_arm_keeps_its_joints_within_their_ranges(say: Say, turning: float) -> None:
    rig, farthest = Rig(say), 0.0
    for _ in range(900):
        rig.lead([0.0, 0.0, 0.0, turning, 0.0, 0.0])
        farthest = max(farthest, float(np.abs(rig.at).max()))
    end = CHAIN.limits.upper.max()
    assert end - 0.1 < farthest <= end
    assert any(name.startswith("joint_") for name in rig.names)


@pytest.mark.parametrize("kind", ["workspace", "region"])
@pytest.mark.parametrize("say", [VelocitySpeech, trajectory])
def test_a_late_arm_keeps_its_tool_off_walls_and_regions(say: Say, kind: str) -> None:
    room_m = 0.08
    start = pose_of(CHAIN.poses(BENT)).position
    plane = Plane(start - np.array([0.0, 0.0, room_m]), np.array([0.0, 0.0, 1.0]))
    rig = Rig(say, (plane,)) if kind == "region" else Rig(say, room_m=room_m)
    for _ in range(600):
        rig.lead([0.0, 0.0, -0.25, 0.0, 0.0, 0.0])
        assert rig.moved()[2] > -room_m
    assert rig.moved()[2] < -room_m + 0.02
    assert kind in rig.names


def test_a_trajectory_does_not_run_away_from_an_arm_that_is_held() -> None:
    rig = Rig(trajectory)
    held, twist = rig.report(), np.array([0.1, 0, 0, 0, 0, 0])
    for _ in range(500):
        message = rig.leading.led(twist, held, PERIOD_S, 0).message
    assert message is not None
    ahead = np.abs(np.array(message["points"][0]["positions"]) - BENT)
    needed = np.abs(np.linalg.solve(CHAIN.jacobians(BENT), twist))
    assert (ahead <= (2 * DELAY_S + SPAN_S) * needed + 0.021).all()
    assert ahead.max() > 0.02


def test_a_stop_holds_the_joints_for_a_while_and_then_says_nothing() -> None:
    rig = Rig(trajectory)
    assert rig.leading.standing(0, 0).message is None, "where it is was never heard"
    moving = rig.lead([0.05, 0, 0, 0, 0, 0], 50)
    stopped = rig.leading.standing(10, 0).message
    assert stopped is not None
    at = np.array(stopped["points"][0]["positions"])
    ahead = np.array(moving["points"][0]["positions"]) - at
    assert 0.0 < np.abs(ahead).max() < 0.05
    assert rig.leading.standing(10 + HELD_FOR_NS, 0).message == stopped
    assert rig.leading.standing(11 + HELD_FOR_NS, 0).message is None


def test_an_arm_that_starts_anew_elsewhere_is_led_on_from_there() -> None:
    rig = Rig(trajectory)
    rig.lead([0.05, 0, 0, 0, 0, 0], 50)
    rig.leading.standing(0, 0)
    elsewhere = BENT + 0.5
    report = ArmReport(pose_of(CHAIN.poses(elsewhere)), np.zeros(6), 0.0, 0, elsewhere)
    message = rig.leading.led(np.zeros(6), report, PERIOD_S, 0).message
    assert message is not None
    np.testing.assert_allclose(message["points"][0]["positions"], elsewhere)
    assert message["joint_names"] == list(CHAIN.joint_names)
    assert message["points"][0]["time_from_start"] == {"sec": 0, "nanosec": 50_000_000}


def test_velocities_are_in_the_order_of_the_controller_and_zeros_while_it_stands() -> None:
    names = CHAIN.joint_names
    forward = Rig().lead([0.05, 0.02, 0, 0, 0.1, 0])["data"]
    backward = Rig(lambda chain: VelocitySpeech(chain, names[::-1])).lead(
        [0.05, 0.02, 0, 0, 0.1, 0]
    )["data"]
    assert np.abs(forward).min() > 0.0
    assert backward == forward[::-1]
    assert VelocitySpeech(CHAIN).held(None, 10**12) == {"data": [0.0] * 6}


@pytest.mark.parametrize("joints", [("j1",), ("j1", "j2", "j3", "j4", "j5", "j7")])
def test_joints_that_are_not_the_arms_are_refused(joints: tuple[str, ...]) -> None:
    chosen = RosRobotSettings(command="joint_velocity", joints=joints)
    limits = tool_limits_of(TASK, DELAY_S, 2.0, 10.0)
    with pytest.raises(UserError, match=r"expected those between base and tool.* j1, j2"):
        joint_leading_of(chosen, limits, fence_of(TASK, limits), CHAIN)


def test_the_kind_of_command_decides_what_is_said() -> None:
    limits = tool_limits_of(TASK, DELAY_S, 2.0, 10.0)
    said = {}
    for kind in ("joint_velocity", "joint_trajectory"):
        chosen = RosRobotSettings(command=kind, trajectory_s=0.2)
        leading = joint_leading_of(chosen, limits, fence_of(TASK, limits), CHAIN)
        said[kind] = leading.led(np.zeros(6), Rig().report(), PERIOD_S, 0).message
    assert set(said["joint_velocity"] or ()) == {"data"}
    points = (said["joint_trajectory"] or {})["points"]
    assert points[0]["time_from_start"]["nanosec"] == 200_000_000
