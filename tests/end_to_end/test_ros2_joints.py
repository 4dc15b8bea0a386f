"""A ROS arm led by its joints, over real rclpy: it follows, keeps within its ranges, is stopped."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: hmcs-ros2-bridge[ros], or one installed")

from hmcs.arms.chain import Chain, chain_of
from hmcs.arms.state import Pose
from hmcs.arms.urdf import read_urdf
from hmcs.motion.quaternions import between
from hmcs.task import load_task
from hmcs_robot.kinematics import inverse_kinematics
from hmcs_robot.robots import ROBOTS
from support.ros_cell import SPEED, Driver, ros_stack, start_joint_controller, start_robot
from support.stack import Stack

PUMA, TASK = ROBOTS["puma560"], load_task("human-shapes")


@pytest.fixture
def stack(tmp_path: Path) -> Iterator[Stack]:
    with ros_stack(tmp_path) as stack:
        yield stack


@pytest.fixture(scope="module")
def chain() -> Chain:
    return chain_of(read_urdf(PUMA.urdf), "tool")


@pytest.fixture(scope="module")
def start(chain: Chain) -> list[float]:
    """Joint positions at which the tool is where the task begins."""
    robot = TASK.robot
    pose = Pose(np.array(robot.tool_start_m), np.array(robot.tool_orientation_xyzw))
    home = np.array(PUMA.home)
    return [float(at) for at in inverse_kinematics(chain.at(home), robot.name, pose, home)]


@pytest.mark.parametrize("kind", ["joint_velocity", "joint_trajectory"])
def test_an_arm_led_by_its_joints_follows_and_is_stopped_where_it_falls_silent(
    stack: Stack, chain: Chain, start: list[float], kind: str
) -> None:
    driver = Driver(stack)
    controller = start_joint_controller(stack, kind, start)
    robot = start_robot(stack, "--command", kind, "--tool-link", "tool")
    stack.until_ready(robot)
    driver.twist = np.array([0.0, SPEED, 0.0, 0.0, 0.0, 0.0])
    driver.until_following()
    first = driver.states[-1]
    stack.until(lambda: driver.states[-1].tool_position[1] - first.tool_position[1] > 0.05)
    now = driver.states[-1]
    moved = now.tool_position - first.tool_position
    assert np.abs(moved[[0, 2]]).max() < 0.006
    assert np.linalg.norm(between(first.tool_orientation, now.tool_orientation)) < 0.02
    assert set(now.joint_names) == set(chain.joint_names)

    controller.send(signal.SIGKILL)
    stack.until(lambda: driver.states[-1].stop == "silent_arm")
    driver.states.clear()
    controller = start_joint_controller(stack, kind, start)
    begin = TASK.robot.tool_start_m

    def heard_anew() -> bool:
        return bool(np.allclose(driver.states[-1].tool_position, begin, atol=1e-3))

    stack.until(lambda: driver.states and heard_anew() and stack.health(robot).healthy)
    stack.elapse(0.3)
    assert all(state.stop != "none" for state in driver.states)
    assert heard_anew(), "it is not moved back to where it was"
    driver.until_following()
    assert controller.running, controller.exit_code


@pytest.mark.parametrize("kind", ["joint_velocity", "joint_trajectory"])
def test_an_arm_led_into_the_end_of_a_range_slows_down_before(
    stack: Stack, chain: Chain, start: list[float], kind: str
) -> None:
    # Of the six joints the last one is the only that turns the tool about its own axis.
    begun = [*start[:-1], float(chain.limits.upper[-1]) - 0.3]
    driver = Driver(stack)
    controller = start_joint_controller(stack, kind, begun)
    robot = start_robot(stack, "--command", kind, "--tool-link", "tool")
    stack.until_ready(robot)
    axis = chain.jacobians(np.array(begun))[3:, -1]
    driver.twist = np.concatenate([np.zeros(3), 0.4 * axis])
    driver.engaged = False
    stack.until(lambda: driver.states and driver.states[-1].stop == "disengaged")
    driver.engaged = True
    stack.until(lambda: "joint_6" in driver.states[-1].limited)
    stack.until(lambda: np.linalg.norm(driver.states[-1].tool_twist[3:]) < 0.01)
    names = driver.states[-1].joint_names
    last = driver.states[-1].joint_positions[names.index(chain.joint_names[-1])]
    room = chain.limits.upper[-1] - last
    assert 0.0 < room < 0.1
    assert controller.running, controller.last_lines()
