"""Arms of one's own come up in the closed loop and follow a circle."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.arms.chain import pose_of
from hmcs.task import Task, load_task
from hmcs_robot.description.described import describe
from hmcs_robot.kinematics import UnreachablePoseError
from hmcs_robot.lockstep import LockstepRobot
from hmcs_robot.robots import RobotModel, model_of
from hmcs_robot.set_up import simulated
from hmcs_robot.settings import RobotSettings
from hmcs_robot.simulation import StartPoseError
from support.urdfs import LIMIT, arm, joint, link, written

RADIUS_M, ROUND_S, PERIOD_S = 0.04, 3.0, 0.01
RAIL = link("ground", 20.0) + joint(
    "rail", "ground", "base", "prismatic", "0 1 0",
    more='<limit lower="-1" upper="1" effort="500" velocity="0.5"/>',
)  # fmt: skip
FINGERS = "".join(
    [
        link("a", 0.05),
        joint("finger", "tool", "a", axis="0 1 0", xyz="0.02 0.03 0"),
        link("b", 0.05),
        joint("other", "tool", "b", axis="0 1 0", more=LIMIT + '<mimic joint="finger"/>'),
    ]
)
PARALLEL = joint(
    "j3", "l2", "l3", axis="0 1 0", xyz="0 0 0.4",
    more=LIMIT + '<mimic joint="j2" multiplier="-1.5" offset="1"/>',
)  # fmt: skip
WRITTEN = {
    "six axes": arm(),
    "rail": arm(more=RAIL),
    "reversed axis": arm({1: joint("j1", "base", "l1", axis="0 0 -2", xyz="0 0 0.3")}),
    "continuous wrist": arm(
        {6: joint("j6", "l5", "l6", "continuous", "1 0 0", "0.06 0 0", '<limit effort="20"/>')}
    ),
    "mimic gripper": arm(more=FINGERS),
    "five axes": arm({4: joint("j4", "l3", "l4", "fixed", xyz="0.2 0 0")}),
    "four axes": arm(
        {k: joint(f"j{k}", f"l{k - 1}", f"l{k}", "fixed", xyz="0.2 0 0") for k in (4, 6)}
    ),
    "three axes": arm(
        {k: joint(f"j{k}", f"l{k - 1}", f"l{k}", "fixed", xyz="0.1 0 0") for k in (4, 5, 6)}
    ),
    "no limits": arm({2: joint("j2", "l1", "l2", axis="0 1 0", xyz="0 0 0.2", more="")}),
}
PUBLIC = {
    "kuka_iiwa/model.urdf": "lbr_iiwa_link_7",
    "franka_panda/panda.urdf": "panda_hand",
    "xarm/xarm6_robot.urdf": "link6",
    "xarm/xarm6_with_gripper.urdf": "xarm_gripper_base_link",
}


def task_of(file: Path, **robot: Any) -> Task:
    """Return a task for an arm that begins where its home is."""
    like = load_task("human-shapes").model_dump(exclude_defaults=True)
    setup = {"tool_start_m": (0, 0, 0), "tool_orientation_xyzw": (0, 0, 0, 1)} | robot
    like["robot"] = {"urdf": str(file), **setup}
    like["workspace"] = {"lower_m": (-4, -4, -4), "upper_m": (4, 4, 4)}
    task = Task.model_validate(like)
    if "tool_start_m" not in robot:
        described = describe(model_of(task.robot))
        start = pose_of(described.chain.poses(described.home))
        like["robot"]["tool_start_m"] = tuple(start.position)
        like["robot"]["tool_orientation_xyzw"] = tuple(start.orientation)
        task = Task.model_validate(like)
    return task


def off_the_circle_m(task: Task, engine: str) -> float:
    """Return how far the tool is from a circle that it is led along, at most."""
    robot = LockstepRobot(task, engine)
    begun, turns = robot.position, 2 * np.pi / ROUND_S
    off = []
    for cycle in range(round(ROUND_S / PERIOD_S)):
        angle = turns * PERIOD_S * cycle
        along = np.array([0.0, np.cos(angle), -np.sin(angle)])
        robot.move(np.concatenate([RADIUS_M * turns * along, np.zeros(3)]), PERIOD_S)
        angle += turns * PERIOD_S
        led = begun + RADIUS_M * np.array([0.0, np.sin(angle), np.cos(angle) - 1.0])
        off.append(float(np.linalg.norm(robot.position - led)))
    robot.close()
    return max(off)


@pytest.mark.parametrize("name", WRITTEN)
def test_an_arm_of_ones_own_follows_a_circle(tmp_path: Path, name: str, engine: str) -> None:
    task = task_of(written(tmp_path, WRITTEN[name]), tool_link="tool")
    assert off_the_circle_m(task, engine) < 0.002


@pytest.mark.parametrize("name", PUBLIC)
def test_a_public_arm_follows_a_circle(name: str, engine: str) -> None:
    found = find_spec("pybullet_data")
    if found is None or found.origin is None:
        pytest.skip("PyBullet brings the descriptions, and is not installed")
    task = task_of(Path(found.origin).parent / name, tool_link=PUBLIC[name])
    assert off_the_circle_m(task, engine) < 0.002


def test_joints_that_follow_others_are_followed(tmp_path: Path, engine: str) -> None:
    task = task_of(written(tmp_path, arm({3: PARALLEL}, RAIL)), tool_link="tool")
    assert off_the_circle_m(task, engine) < 0.002


def test_a_start_out_of_reach_names_the_reach(tmp_path: Path, engine: str) -> None:
    file = written(tmp_path, arm())
    task = task_of(file, tool_start_m=(3.0, 0.0, 0.5), tool_orientation_xyzw=(0, 0, 0, 1))
    with pytest.raises(UnreachablePoseError, match=r"robot own .*gets up to 1\.\d+ m"):
        LockstepRobot(task, engine)


def test_a_task_begins_in_the_posture_it_names(tmp_path: Path, engine: str) -> None:
    file = written(tmp_path, arm())
    # The elbow the other way round than at the home that is found.
    given = {"ready": (0.2, 0.9, -1.6, 0.3, 0.5, 0.1)}
    start = pose_of(describe(RobotModel(file, "tool")).chain.poses(np.array(given["ready"])))
    place = {
        "tool_start_m": tuple(start.position),
        "tool_orientation_xyzw": tuple(start.orientation),
    }
    task = task_of(file, tool_link="tool", poses=given, start_pose="ready", **place)
    simulation = simulated(task, RobotSettings(engine=engine))
    np.testing.assert_allclose(simulation.read().joint_positions, given["ready"], atol=1e-6)
    simulation.close()
    elsewhere = task_of(
        file, tool_link="tool", poses=given, start_pose="ready",
        tool_start_m=(0.5, 0.0, 0.5), tool_orientation_xyzw=(0, 0, 0, 1),
    )  # fmt: skip
    with pytest.raises(StartPoseError, match=r"write tool_start_m: \[0\.\d+, "):
        LockstepRobot(elsewhere, engine)
    with pytest.raises(ValueError, match="start_pose is 'rest', expected one of poses: ready"):
        task_of(file, tool_link="tool", poses=given, start_pose="rest", **place)
