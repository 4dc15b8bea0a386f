from __future__ import annotations

import numpy as np
import pytest

from hmcs.arms.state import Pose
from hmcs.errors import UserError
from hmcs.motion import quaternions
from hmcs_robot.engine import Engine
from hmcs_robot.kinematics import UnreachablePoseError, inverse_kinematics
from hmcs_robot.robots import ROBOTS


def drawn(arm: Engine, count: int) -> np.ndarray:
    room = 0.1 * (arm.limits.upper - arm.limits.lower)
    return np.random.default_rng(3).uniform(
        arm.limits.lower + room, arm.limits.upper - room, (count, len(room))
    )


def test_jacobian_is_the_derivative_of_forward_kinematics(arm: Engine) -> None:
    h = 1e-6
    for q in drawn(arm, 20):
        jacobian = arm.jacobian(q)
        for joint in range(len(q)):
            step = h * np.eye(len(q))[joint]
            arm.place(q + step)
            ahead = arm.tool()
            arm.place(q - step)
            behind = arm.tool()
            linear = (ahead.position - behind.position) / (2 * h)
            angular = quaternions.between(behind.orientation, ahead.orientation) / (2 * h)
            assert np.abs(jacobian[:3, joint] - linear).max() < 1e-7
            assert np.abs(jacobian[3:, joint] - angular).max() < 1e-7


def test_a_point_of_any_link_moves_as_commanded(arm: Engine) -> None:
    h, normal = 1e-6, np.array([0.6, 0.0, 0.8])
    for q in drawn(arm, 5):
        arm.place(q)
        tool = arm.tool()
        # The tool is a point of the last moving link as well as of its own.
        last = max(arm.moving_links)
        found = arm.separation_per_joint(last, tool.position, normal, q)
        for joint in range(len(q)):
            step = h * np.eye(len(q))[joint]
            arm.place(q + step)
            ahead = arm.tool().position
            arm.place(q - step)
            assert found[joint] == pytest.approx(
                normal @ (ahead - arm.tool().position) / (2 * h), abs=1e-7
            )


def test_inverse_kinematics_is_undone_by_forward_kinematics(robot: str, arm: Engine) -> None:
    home = np.array(ROBOTS[robot].home)
    for q in drawn(arm, 6):
        arm.place(q)
        target = arm.tool()
        found = inverse_kinematics(arm, robot, target, home)
        arm.place(found)
        reached = arm.tool()
        assert np.abs(reached.position - target.position).max() < 1e-5
        assert np.linalg.norm(quaternions.between(reached.orientation, target.orientation)) < 1e-4
        assert (found >= arm.limits.lower).all()
        assert (found <= arm.limits.upper).all()


def test_the_first_pose_of_each_robot_is_far_from_singular(
    robot: str, arm: Engine, starts: dict[str, Pose]
) -> None:
    found = inverse_kinematics(arm, robot, starts[robot], np.array(ROBOTS[robot].home))
    assert np.linalg.svd(arm.jacobian(found), compute_uv=False)[-1] > 0.1


def test_an_unreachable_pose_names_pose_robot_and_the_distance_short(
    robot: str, arm: Engine
) -> None:
    target = Pose(np.array([2.5, 0.0, 0.5]), np.array([0.0, 0.0, 0.0, 1.0]))
    with pytest.raises(UnreachablePoseError) as error:
        inverse_kinematics(arm, robot, target, np.array(ROBOTS[robot].home))
    assert isinstance(error.value, UserError)
    for part in (robot, "(2.500, 0.000, 0.500)", "m and", "short", "tool_start_m"):
        assert part in str(error.value)
