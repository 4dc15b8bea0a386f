"""Which joints lead to the tool, and where the tool is at them."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from hmcs.arms.urdf import UrdfError, read_urdf
from hmcs.motion import forward_kinematics
from hmcs.task import RobotSetup, load_task
from hmcs_ros2_bridge.arm_chain import chain_in, urdf_named
from hmcs_ros2_bridge.arm_state import ArmReports
from hmcs_ros2_bridge.robot_settings import RosRobotSettings
from support.urdfs import arm, joint, written

ROBOT = load_task("human-shapes").robot
FOREARM = '<link name="camera_tool"/>' + joint("to_camera", "l6", "camera_tool", "fixed", more="")


def settings(**chosen: Any) -> RosRobotSettings:
    return RosRobotSettings(**({"command": "joint_velocity"} | chosen))


def message(**joints: float) -> Any:
    stamp = SimpleNamespace(sec=3, nanosec=500_000_000)
    return SimpleNamespace(
        header=SimpleNamespace(stamp=stamp, frame_id=""),
        name=list(joints),
        position=list(joints.values()),
        velocity=[],
    )


def told(**urdf: Any) -> RobotSetup:
    return ROBOT.model_copy(update={"model": None} | urdf)


def test_the_tool_is_where_another_implementation_has_it(tmp_path: Path) -> None:
    file = written(tmp_path, arm())
    reports = ArmReports("base_link", by_joints=True)
    assert not reports.take_joints(message(j1=0.1), 5), "its URDF is not known yet"
    assert not reports.refusal
    reports.chain = chain_in(read_urdf(file), settings(), ROBOT)
    at = {f"j{k}": 0.3 * k - 1.0 for k in range(6, 0, -1)}
    assert reports.take_joints(message(finger=0.01, **at), 7)
    assert not reports.take_joints(message(**at), 8), "one is waiting already"
    reports.handled()
    assert reports.take_joints(message(**at), 9)
    report = reports.newest
    assert report is not None
    chain = forward_kinematics.read_chain(file, "tool")
    places, turns = forward_kinematics.poses(chain, list(at), np.array([list(at.values())]))
    np.testing.assert_allclose(report.pose.position, places[0], atol=1e-9)
    np.testing.assert_allclose(np.abs(report.pose.orientation @ turns[0]), 1.0, atol=1e-9)
    np.testing.assert_allclose(report.joint_positions, [at[f"j{k}"] for k in range(1, 7)])
    assert (report.heard_ns, report.stamp_s) == (9, 3.5)


def test_joints_of_others_are_no_report_and_missing_ones_are_told(tmp_path: Path) -> None:
    reports = ArmReports("base_link", by_joints=True)
    reports.chain = chain_in(read_urdf(written(tmp_path, arm())), settings(), ROBOT)
    assert not reports.take_joints(message(finger=0.01), 1)
    assert (reports.refused, reports.joints.names) == (0, ())
    assert not reports.take_joints(message(j1=0.0, j2=0.0, j3=0.0, j4=0.0, j6=0.0), 1)
    assert reports.refused == 1
    assert reports.refusal == "the robot tells no position of j5"
    assert reports.newest is None


def test_where_the_tool_has_a_topic_joints_are_only_shown() -> None:
    reports = ArmReports("base_link")
    assert not reports.take_joints(message(a=1.0), 1)
    assert reports.joints.names == ("a",)
    assert reports.newest is None


def test_the_urdf_is_that_of_the_settings_else_of_the_task(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    one, other = written(tmp_path, arm()), written(tmp_path / "other", arm())
    named = urdf_named(settings(urdf=one), told(urdf=str(other)))
    assert named is not None
    assert named.file == one
    named = urdf_named(settings(), told(urdf=str(other)))
    assert named is not None
    assert named.file == other
    assert urdf_named(settings(), ROBOT) is None


def test_the_tool_link_is_that_of_the_settings_else_of_the_task(tmp_path: Path) -> None:
    urdf = read_urdf(written(tmp_path, arm(more=FOREARM)))
    with pytest.raises(UrdfError, match=r"which link is the tool.*tool, camera_tool"):
        chain_in(urdf, settings(), ROBOT)
    by_task = chain_in(urdf, settings(), told(tool_link="camera_tool"))
    by_settings = chain_in(urdf, settings(tool_link="tool"), told(tool_link="camera_tool"))
    assert by_task.poses(np.zeros(6))[0, 3] == pytest.approx(0.46)
    assert by_settings.poses(np.zeros(6))[0, 3] == pytest.approx(0.54)


def test_joints_count_from_the_frame_of_commands_on(tmp_path: Path) -> None:
    world = '<link name="world"/>' + joint("stand", "world", "base", "fixed", xyz="1 2 3", more="")
    urdf = read_urdf(written(tmp_path, arm(more=world)))
    at_world = chain_in(urdf, settings(), ROBOT).poses(np.zeros(6))[:3, 3]
    at_base = chain_in(urdf, settings(base_frame="base"), ROBOT).poses(np.zeros(6))[:3, 3]
    np.testing.assert_allclose(at_world - at_base, [1.0, 2.0, 3.0])


def test_an_arm_of_two_joints_can_be_watched_but_not_led_by_them(tmp_path: Path) -> None:
    urdf = read_urdf(written(tmp_path, arm()))
    short = settings(command="twist", tool_pose_from="joints", tool_link="l2")
    assert len(chain_in(urdf, short, ROBOT).joint_names) == 2
    with pytest.raises(UrdfError, match="there are 2 joints that move"):
        chain_in(urdf, settings(tool_link="l2"), ROBOT)
    assert len(chain_in(urdf, settings(tool_link="l4"), ROBOT).joint_names) == 4


def test_joints_are_commanded_by_joints_alone() -> None:
    assert settings().pose_from == "joints"
    assert settings(command="twist").pose_from == "topic"
    with pytest.raises(ValidationError, match="joint_velocity needs joints: leave it out"):
        settings(tool_pose_from="topic")


def test_every_kind_of_command_has_its_topic() -> None:
    topics = {
        settings(command=kind).commanded_topic
        for kind in ("twist", "joint_velocity", "joint_trajectory")
    }
    assert len(topics) == 3
    assert settings(command_topic="/mine").commanded_topic == "/mine"
