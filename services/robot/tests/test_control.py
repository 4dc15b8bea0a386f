from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hmcs.arms.control import Following, Standing, Tuning, stand
from hmcs.arms.inverses import Inverse
from support.arms import arm, needs

SPEED_TOLERANCE = 1.02
WALL_TOLERANCE_M = 1e-4

parts = st.one_of(
    st.floats(-0.5, 0.5, allow_subnormal=False),
    st.floats(allow_nan=False, allow_infinity=False),
)
twists = st.tuples(*[parts] * 6).map(np.array)


def assert_within_limits(bench: Any, after: str) -> None:
    arm, limits = bench.simulation.read(), bench.limits
    q, tool = arm.joint_positions, arm.tool.position
    assert (q >= limits.joints.lower).all(), after
    assert (q <= limits.joints.upper).all(), after
    assert (tool >= limits.workspace_lower_m - WALL_TOLERANCE_M).all(), after
    assert (tool <= limits.workspace_upper_m + WALL_TOLERANCE_M).all(), after
    twist = arm.tool_twist
    assert np.linalg.norm(twist[:3]) <= SPEED_TOLERANCE * limits.speed_m_s, after
    assert np.linalg.norm(twist[3:]) <= SPEED_TOLERANCE * limits.angular_speed_rad_s, after


@settings(max_examples=6, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(twists, st.integers(1, 80)), min_size=1, max_size=8))
def test_no_finite_command_leads_beyond_a_limit(
    bench: Any, commands: list[tuple[np.ndarray, int]]
) -> None:
    rig = bench(half_m=0.06)
    for twist, cycles in commands:
        for _ in range(cycles):
            rig.follow(twist)
            assert_within_limits(rig, f"{twist}")
    rig.simulation.close()


@pytest.mark.long
@pytest.mark.parametrize("robot", [arm("puma560"), arm("iiwa"), arm("panda")])
def test_the_ends_of_the_joints_ranges_hold_and_let_the_arm_come_back(
    bench: Any, robot: str
) -> None:
    for direction in np.vstack([np.eye(6), -np.eye(6)])[[0, 4, 5, 10]]:
        rig = bench(robot, half_m=2.0)
        rig.limits = replace(rig.limits, speed_m_s=0.5, angular_speed_rad_s=1.5)
        met: set[str] = set()
        for _ in range(360):
            met |= set(rig.follow(direction).limited)
            assert_within_limits(rig, f"{direction}")
        there = rig.simulation.read()
        for _ in range(120):
            rig.follow(-direction)
            assert_within_limits(rig, f"back from {direction}")
        moved = np.abs(rig.simulation.read().joint_positions - there.joint_positions).max()
        assert moved > 0.01, (direction, met)
        rig.simulation.close()


def test_turning_the_wrist_on_and_on_names_the_joint_that_ends(bench: Any) -> None:
    rig = bench(half_m=2.0)
    rig.limits = replace(rig.limits, angular_speed_rad_s=1.5)
    met: set[str] = set()
    for _ in range(1500):
        met |= set(rig.follow([0, 0, 0, 1.5, 0, 0]).limited)
    assert any(name.startswith("joint_") and name != "joint_speed" for name in met)
    assert np.abs(rig.simulation.read().joint_velocities).max() < 0.01


def test_the_speed_limit_keeps_the_direction(bench: Any) -> None:
    rig = bench()
    wanted = np.array([0.3, -0.9, 0.6])
    for _ in range(60):
        motion = rig.follow([*(1e6 * wanted), 0, 0, 0])
    made = motion.reference_twist[:3]
    assert "speed" in motion.limited
    assert np.linalg.norm(made) == pytest.approx(0.25)
    assert made / 0.25 == pytest.approx(wanted / np.linalg.norm(wanted))


def test_a_wall_takes_only_the_part_that_leads_out(bench: Any) -> None:
    rig = bench(half_m=0.05)
    for _ in range(240):
        motion = rig.follow([0.0, 0.2, 0.0, 0, 0, 0])
    assert "workspace" in motion.limited
    at_wall = rig.simulation.read().tool.position
    assert 0.0 < rig.limits.workspace_upper_m[1] - at_wall[1] < 0.004
    for _ in range(48):
        motion = rig.follow([0.0, 0.2, 0.1, 0, 0, 0])
    assert motion.reference_twist[2] == pytest.approx(0.1, rel=1e-3)
    assert rig.simulation.read().tool.position[2] - at_wall[2] == pytest.approx(0.02, abs=0.003)


def test_a_tool_that_is_drawn_along_a_wall_is_not_drawn_through_it(bench: Any) -> None:
    rig = bench()
    arm = rig.simulation.read()
    at_wall = arm.tool.position + np.array([1.0, rig.limits.wall_margin_m, 1.0])
    rig.limits = replace(rig.limits, workspace_upper_m=at_wall)
    beyond = arm.tool._replace(position=arm.tool.position + np.array([0.0, 0.004, 0.003]))
    rig.carried = Following(beyond, np.zeros(6))
    made = arm.jacobian @ rig.follow(np.zeros(6)).joint_velocities
    assert made[1] <= 1e-6
    assert made[2] == pytest.approx(0.003 * rig.tuning.correction_per_s, rel=0.1)


def test_a_joint_speed_limit_slows_the_whole_motion_without_turning_it(bench: Any) -> None:
    rig = bench()
    slow = rig.limits.joints._replace(speed=np.full(6, 0.05))
    rig.limits = replace(rig.limits, joints=slow)
    for _ in range(120):
        motion = rig.follow([0, 0.1, 0.2, 0, 0, 0])
    made = motion.reference_twist
    assert "joint_speed" in motion.limited
    assert np.abs(motion.joint_velocities).max() == pytest.approx(0.05)
    assert made[2] == pytest.approx(2 * made[1], rel=0.02)
    assert np.abs(made[[0, 3, 4, 5]]).max() < 1e-3


@pytest.mark.long
@pytest.mark.parametrize("robot", [arm("puma560"), arm("iiwa"), arm("panda")])
def test_the_tool_tracks_200_mm_per_s_within_3_mm_per_s_and_without_drift(
    bench: Any, robot: str, period_s: float
) -> None:
    rig = bench(robot)
    begun = rig.simulation.read().tool
    path = begun.position.copy()
    errors = []
    for cycle in range(2400):
        angle = 2.0 * cycle * period_s
        motion = rig.follow([0.0, 0.2 * np.cos(angle), 0.2 * np.sin(angle), 0, 0, 0])
        path += motion.reference_twist[:3] * period_s
        made = rig.simulation.read().tool_twist
        errors.append(made[:3] - motion.reference_twist[:3])
    end = rig.simulation.read().tool
    assert np.sqrt((np.square(errors).sum(axis=1)).mean()) <= 0.003
    assert np.linalg.norm(end.position - path) < 0.001
    assert abs(abs(end.orientation @ begun.orientation) - 1) < 1e-6


@needs("iiwa")
@pytest.mark.long
def test_a_redundant_arm_returns_to_its_posture_when_its_tool_returns(bench: Any) -> None:
    rig = bench("iiwa")
    begun = rig.simulation.read().joint_positions
    for _ in range(5):
        for sign in (1, -1):
            for _ in range(240):
                rig.follow([0, sign * 0.1, sign * 0.1, 0, 0, 0])
    assert np.abs(rig.simulation.read().joint_positions - begun).max() < 0.05


def test_a_stop_brakes_at_once_and_then_holds_the_place(bench: Any) -> None:
    rig = bench()
    for _ in range(120):
        rig.follow([0, 0.25, 0, 0, 0, 0])
    places = []
    for _ in range(1200):
        motion = stand(rig.simulation.read(), rig.carried, rig.tuning)
        rig.carried = motion.carried
        assert not motion.reference_twist.any()
        rig.simulation.move(motion.joint_velocities)
        places.append(rig.simulation.read().tool.position)
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) * 240
    assert speeds[24:].max() < 1e-3, "still moving 100 ms after the stop"
    assert np.linalg.norm(places[-1] - places[48]) < 1e-5


def test_a_standing_arm_returns_to_where_it_was_held(bench: Any) -> None:
    arm = bench().simulation.read()
    away = Standing(arm.joint_positions + 0.002)
    motion = stand(arm, away, Tuning())
    assert motion.joint_velocities == pytest.approx(np.full(6, 0.02))
    assert motion.carried == away


def test_the_reference_never_runs_far_ahead_of_an_arm_that_is_stuck(bench: Any) -> None:
    rig = bench()
    arm = rig.simulation.read()
    for _ in range(240):
        rig.follow([0, 0.25, 0, 0, 0, 0])
        rig.simulation.engine.place(arm.joint_positions)
    assert isinstance(rig.carried, Following)
    ahead = np.linalg.norm(rig.carried.pose.position - arm.tool.position)
    assert ahead <= rig.tuning.largest_lag_m + 0.25 / 240 + 1e-9


def test_near_a_singularity_the_tool_slows_down_and_comes_out_again(bench: Any) -> None:
    rig = bench("puma560", half_m=1.0)
    speeds, clear = [], []
    # Straight out until the elbow is stretched, then back.
    for cycle in range(2400):
        motion = rig.follow([0.15 if cycle < 1200 else -0.15, 0, 0, 0, 0, 0])
        jacobian = rig.simulation.read().jacobian
        speeds.append(float(np.linalg.norm(motion.reference_twist[:3])))
        clear.append(float(np.linalg.svd(jacobian, compute_uv=False)[-1]))
    near = np.array(clear) < 2 * rig.tuning.damping
    assert near[:1200].any()
    assert not near[-1]
    closing = np.diff(clear, prepend=clear[0]) < 0
    allowed = 0.15 * np.clip(np.array(clear) / (2 * rig.tuning.damping), 0.25, 1.0)
    slowed = closing[:-1] & near[:-1]
    # A reference that leads out again is not held up, though the arm may still close in.
    slowed[1199:] = False
    assert slowed.sum() > 20
    assert (np.array(speeds)[1:][slowed] <= allowed[:-1][slowed] + 1e-3).all()


@pytest.mark.parametrize(
    ("robot", "plan"),
    [
        arm("iiwa", [(8.0, [0.2, 0, 0, 0, 0, 0])]),
        arm("panda", [(3.0, [0.2, 0, 0, 0, 0, 0]), (5.0, [0, 0, 0.1, 0, 0, 0])]),
        ("puma560", [(6.0, [0.2, 0, 0.05, 0, 0, 0])]),
    ],
)
def test_an_arm_pushed_on_at_the_end_of_its_reach_settles(
    bench: Any, robot: str, plan: Any
) -> None:
    rig = bench(robot, half_m=2.0)
    speeds = []
    for seconds, twist in plan:
        for _ in range(round(seconds * 240)):
            speeds.append(float(np.linalg.norm(rig.follow(twist).reference_twist[:3])))
    change = np.diff(speeds[-3 * 240 :])
    both = np.minimum(np.abs(change[1:]), np.abs(change[:-1]))
    assert ((change[1:] * change[:-1] < 0) & (both > 0.005)).sum() == 0


def test_the_way_into_a_singularity_is_the_one_finite_differences_find(bench: Any) -> None:
    rig = bench("puma560", half_m=1.0)
    for _ in range(600):
        rig.follow([0.15, 0.02, 0, 0, 0, 0.05])
    arm = rig.simulation.read()
    inverse = Inverse(arm.jacobian, 0.02)
    found = []
    for joint in range(6):
        pair = []
        for sign in (1, -1):
            moved = arm.joint_positions.copy()
            moved[joint] += sign * 1e-5
            rig.simulation.engine.place(moved)
            jacobian = rig.simulation.engine.jacobian(moved)
            pair.append(np.linalg.svd(jacobian, compute_uv=False)[-1])
        found.append((pair[0] - pair[1]) / 2e-5)
    np.testing.assert_allclose(inverse._growth(), found, atol=1e-4)


def test_the_reference_changes_within_the_acceleration_limit_whatever_limits_it(bench: Any) -> None:
    rig = bench("puma560", half_m=0.05)
    before = np.zeros(6)
    random = np.random.default_rng(3)
    for cycle in range(2000):
        if cycle % 100 == 0:
            twist = np.concatenate([random.uniform(-0.3, 0.3, 3), random.uniform(-0.6, 0.6, 3)])
        now = rig.follow(twist).reference_twist
        speeding_up = np.linalg.norm(now[:3]) > np.linalg.norm(before[:3])
        if speeding_up:
            assert np.linalg.norm(now[:3] - before[:3]) <= 10.0 / 240 + 1e-9
        before = now
