"""The control room: an arm that does what its limits, its regions and fresh orders admit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hmcs.arms.control import Tuning
from hmcs.arms.fence import Fence
from hmcs.arms.state import ArmState, JointLimits, Pose
from hmcs.arrays import Array
from hmcs.fixtures.regions.forbidden import Plane, Region, sphere
from hmcs.fixtures.regions.tool_shape import ToolShape
from hmcs.supervision import Order, Policy
from hmcs_robot.arm_description import ArmDescription
from hmcs_robot.channel import Numbered, SignOfLife, StopAsked, Unpaired
from hmcs_robot.control_loop import ControlLoop, Rules
from support.arms import limits_about

PERIOD_NS = 4_000_000
MS = 1_000_000
UNTURNED = np.array([0.0, 0.0, 0.0, 1.0])


class Gantry:
    """An ideal arm: three slides and three turns, each along an axis of the base."""

    name = "gantry"
    joint_names = ("x", "y", "z", "rx", "ry", "rz")
    links_within = ()
    limits = JointLimits(np.full(6, -10.0), np.full(6, 10.0), np.full(6, 10.0))

    def __init__(self) -> None:
        self.joints, self.speeds = np.zeros(6), np.zeros(6)

    def read(self) -> ArmState:
        return ArmState(
            self.joints.copy(), self.speeds.copy(), Pose(self.joints[:3].copy(), UNTURNED),
            np.eye(6), None, (),
        )  # fmt: skip

    def move(self, joint_velocities: Array) -> None:
        self.speeds = joint_velocities
        self.joints = self.joints + joint_velocities * (PERIOD_NS / 1e9)

    def robot_description(self) -> ArmDescription:
        return ArmDescription("", self.joint_names, {})

    def close(self) -> None:
        pass


class Room(NamedTuple):
    """A control loop with its arm, and somebody who orders."""

    arm: Gantry
    loop: ControlLoop

    def order(self, now_ns: int, twist: Array | None, valid_ms: int = 80) -> None:
        moving = np.zeros(6) if twist is None else twist
        order = Order(b"w", moving, valid_ms * MS, twist is not None, now_ns)
        self.loop.take([SignOfLife(0), Numbered(now_ns, order)], now_ns)

    def run(
        self, begin_ns: int, ticks: int, twist: Array | None = None, silent: bool = False
    ) -> int:
        for tick in range(ticks):
            now_ns = begin_ns + (tick + 1) * PERIOD_NS
            if silent:
                self.loop.take([SignOfLife(0)], now_ns)
            else:
                self.order(now_ns, twist)
            self.loop.tick(now_ns)
        return begin_ns + ticks * PERIOD_NS

    def engage(self, twist: Array) -> int:
        return self.run(self.run(0, 1), 1, twist)


@pytest.fixture
def room() -> Callable[..., Room]:
    def make(*regions: Region, tool: ToolShape | None = None) -> Room:
        arm = Gantry()
        limits = limits_about(arm.limits, np.zeros(3), 5.0)
        fence = Fence(regions, tool or ToolShape.ball(0.0), 0.1)
        return Room(arm, ControlLoop(arm, Rules(limits, Tuning(), Policy(), fence, PERIOD_NS), 0))

    return make


ALONG_X = np.array([0.2, 0, 0, 0, 0, 0])


def test_without_fresh_orders_it_comes_to_a_stand_within_its_acceleration_limits(room) -> None:
    made = room()
    now_ns = made.engage(ALONG_X)
    now_ns = made.run(now_ns, 50, ALONG_X)
    speeds = []
    for _ in range(50):
        now_ns = made.run(now_ns, 1, silent=True)
        speeds.append(float(np.linalg.norm(made.loop.snapshot().reference_twist[:3])))
    assert speeds[0] == pytest.approx(0.2)
    assert speeds[-1] == 0.0
    assert max(-np.diff(speeds)) <= 10.0 * PERIOD_NS / 1e9 + 1e-9
    first_zero = next(k for k, speed in enumerate(speeds) if speed == 0.0)
    assert first_zero * PERIOD_NS <= 120 * MS
    assert made.loop.snapshot().stop == "stale_command"


def test_no_order_counts_longer_than_the_robots_own_setting(room) -> None:
    made = room()
    now_ns = made.engage(ALONG_X)
    made.order(now_ns, ALONG_X, valid_ms=1000)
    made.run(now_ns, 40, silent=True)
    assert made.loop.stop == "stale_command"


def test_a_stop_that_was_asked_for_outlasts_whatever_is_ordered(room) -> None:
    made = room()
    now_ns = made.engage(ALONG_X)
    made.loop.take([StopAsked()], now_ns)
    now_ns = made.run(now_ns, 50, ALONG_X)
    assert made.loop.stop == "asked"
    assert not made.loop.snapshot().reference_twist.any()
    now_ns = made.run(now_ns, 1)
    made.run(now_ns, 5, ALONG_X)
    assert made.loop.stop == "none"


def test_the_orders_of_a_writer_that_drives_another_robot_move_nothing(room) -> None:
    made = room()
    now_ns = made.engage(ALONG_X)
    made.loop.take([Unpaired(b"w")], now_ns)
    made.run(now_ns, 40, silent=True)
    assert made.loop.stop == "not_paired"


def test_late_ticks_are_counted_and_one_past_the_bound_stops_the_arm_at_once(room) -> None:
    made = room()
    now_ns = made.engage(ALONG_X)
    assert made.loop.tick(now_ns + 3 * PERIOD_NS) == 3
    assert made.loop.snapshot().late_ticks == 1
    assert made.loop.stop == "none"
    late_ns = now_ns + 3 * PERIOD_NS + 60 * MS
    made.order(late_ns, ALONG_X)
    made.loop.tick(late_ns)
    snapshot = made.loop.snapshot()
    assert (snapshot.stop, snapshot.late_ticks) == ("late_tick", 2)
    assert not snapshot.reference_twist.any()


def test_periods_missed_while_it_hung_are_let_go(room) -> None:
    made = room()
    now_ns = made.engage(ALONG_X)
    made.loop.tick(now_ns + 10_000 * MS)
    assert np.linalg.norm(made.arm.joints[:3]) < 0.05
    assert made.loop.due_ns > now_ns + 9_990 * MS


def regions() -> Iterator[tuple[Region, ToolShape]]:
    wall = Plane(np.array([0.05, 0, 0]), np.array([-1.0, 0.2, 0]))
    yield wall, ToolShape.ball(0.0)
    yield wall, ToolShape.ball(0.02)
    yield wall, ToolShape.capsule(np.zeros(3), np.array([0, 0, 0.1]), 0.01)
    yield (
        sphere(np.array([0.1, 0, 0]), 0.05),
        ToolShape.box(np.zeros(3), np.array([0.04, 0.02, 0.06])),
    )


@pytest.mark.parametrize("kind", range(4))
def test_whatever_is_ordered_the_tool_enters_no_region(room, kind) -> None:
    region, tool = list(regions())[kind]

    @settings(max_examples=6, suppress_health_check=[HealthCheck.function_scoped_fixture])
    @given(st.lists(st.lists(st.floats(-1, 1), min_size=3, max_size=3), min_size=1, max_size=6))
    def holds(velocities: list[list[float]]) -> None:
        made = room(region, tool=tool)
        now_ns = made.engage(np.zeros(6))
        for velocity in velocities:
            twist = np.concatenate([velocity, np.zeros(3)])
            for _ in range(40):
                now_ns = made.run(now_ns, 1, twist)
                fence = made.loop._rules.fence
                assert fence.clearance_m(made.arm.read().tool) > -1e-6

    holds()


def test_a_tool_at_a_region_slides_along_it_and_leaves_it_freely(room) -> None:
    made = room(Plane(np.array([0.05, 0, 0]), np.array([-1.0, 0, 0])))
    into_and_along = np.array([0.2, 0.1, 0, 0, 0, 0])
    now_ns = made.engage(into_and_along)
    now_ns = made.run(now_ns, 500, into_and_along)
    assert made.arm.joints[0] == pytest.approx(0.05, abs=2e-3)
    assert made.arm.speeds[1] == pytest.approx(0.1, abs=1e-3)
    assert made.loop.snapshot().limited == ("region",)
    assert made.loop.snapshot().region_distance_m == pytest.approx(0.0, abs=2e-3)
    made.run(now_ns, 100, -ALONG_X)
    assert made.arm.joints[0] < -0.02
