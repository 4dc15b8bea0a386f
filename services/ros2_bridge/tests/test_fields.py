from __future__ import annotations

from types import SimpleNamespace as Ros
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs_ros2_bridge.arm_state import ArmReports, joints_in, report_of
from hmcs_ros2_bridge.fields import (
    Fields,
    NonsenseError,
    check_frame,
    header,
    pose,
    pose_in,
    stamp,
    twist,
    twist_in,
)

NUMBERS = st.floats(-1e3, 1e3)


def made(fields: Fields) -> Any:
    """A ROS message with these fields."""
    return Ros(**{k: made(v) if isinstance(v, dict) else v for k, v in fields.items()})


@given(st.lists(NUMBERS, min_size=6, max_size=6))
def test_a_twist_comes_back_as_it_went(values: list[float]) -> None:
    assert twist_in(made(twist(np.array(values)))).tolist() == values


@given(st.lists(NUMBERS, min_size=3, max_size=3))
def test_a_pose_comes_back_as_it_went(place: list[float]) -> None:
    turn = np.array([0.5, -0.5, 0.5, 0.5])
    position, orientation = pose_in(made(pose(place, turn)))
    assert position.tolist() == place
    assert orientation == pytest.approx(turn)


@given(st.integers(0, 2**60))
def test_a_stamp_has_every_nanosecond(time_ns: int) -> None:
    stamped = stamp(time_ns)
    assert stamped["sec"] * 1_000_000_000 + stamped["nanosec"] == time_ns
    assert 0 <= stamped["nanosec"] < 1_000_000_000


@pytest.mark.parametrize("nonsense", [float("nan"), float("inf"), -float("inf")])
def test_what_is_not_finite_is_refused(nonsense: float) -> None:
    with pytest.raises(NonsenseError, match="finite"):
        twist_in(made(twist(np.array([0, 0, 0, 0, 0, nonsense]))))
    with pytest.raises(NonsenseError, match="finite"):
        pose_in(made(pose((0, nonsense, 0), (0, 0, 0, 1))))


def test_an_orientation_that_is_no_rotation_is_refused() -> None:
    with pytest.raises(NonsenseError):
        pose_in(made(pose((0, 0, 0), (0, 0, 0, 0))))


def test_another_frame_is_refused_by_its_name() -> None:
    check_frame(made({"header": header(0, "/base_link")}), ("base_link",))
    with pytest.raises(NonsenseError, match="'camera', expected base_link"):
        check_frame(made({"header": header(0, "camera")}), ("base_link",))


def stamped(x: float, time_s: float, frame: str = "base_link") -> Any:
    fields = {"header": header(round(time_s * 1e9), frame), "pose": pose((x, 0, 0), (0, 0, 0, 1))}
    return made(fields)


def test_the_tools_velocity_is_by_the_arms_own_clock() -> None:
    first = report_of(stamped(0.1, 5.0), 100, None, "base_link")
    then = report_of(stamped(0.12, 5.1), 999_999_999, first, "base_link")
    assert first.twist.tolist() == [0.0] * 6
    assert then.twist == pytest.approx([0.2, 0, 0, 0, 0, 0])


@pytest.mark.parametrize("later_s", [0.0, -1.0, 10.0])
def test_a_clock_that_stands_or_jumps_makes_no_velocity(later_s: float) -> None:
    first = report_of(stamped(0.1, 20.0), 0, None, "base_link")
    then = report_of(stamped(0.5, 20.0 + later_s), 1, first, "base_link")
    assert not then.twist.any()


def test_a_refused_pose_does_not_make_an_arm_look_alive() -> None:
    reports = ArmReports("base_link")
    assert reports.take_pose(stamped(0.1, 1.0), 1_000_000_000)
    assert not reports.take_pose(stamped(0.1, 2.0, "camera"), 3_000_000_000)
    assert reports.age_s(3_000_000_000) == pytest.approx(2.0)
    assert reports.refused == 1
    assert "'camera'" in reports.refusal


def test_poses_that_wait_are_handled_once() -> None:
    reports = ArmReports("base_link")
    assert reports.take_pose(stamped(0.1, 1.0), 1)
    assert not reports.take_pose(stamped(0.2, 1.1), 2), "one already waits"
    reports.handled()
    assert reports.take_pose(stamped(0.3, 1.2), 3)


def test_joints_without_velocities_stand_and_those_that_do_not_fit_are_refused() -> None:
    joints = joints_in(Ros(name=["a", "b"], position=[0.1, 0.2], velocity=[]))
    assert joints.names == ("a", "b")
    assert joints.velocities.tolist() == [0.0, 0.0]
    with pytest.raises(NonsenseError, match="2 joints, 1 positions"):
        joints_in(Ros(name=["a", "b"], position=[0.1], velocity=[]))
    with pytest.raises(NonsenseError, match="finite"):
        joints_in(Ros(name=["a"], position=[float("nan")], velocity=[]))
