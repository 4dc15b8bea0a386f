"""The robot that moves one step at each call."""

from __future__ import annotations

from importlib.metadata import entry_points

import numpy as np
import pytest

from hmcs.task import load_task
from hmcs_robot.lockstep import LockstepRobot

TASK = load_task("lines-through-obstacles")
UP = np.array([0.0, 0.0, 0.1, 0.0, 0.0, 0.0])


@pytest.fixture
def robot(engine: str):
    made = LockstepRobot(TASK, engine)
    yield made
    made.close()


def test_it_begins_where_the_task_does(robot: LockstepRobot) -> None:
    np.testing.assert_allclose(robot.position, TASK.robot.tool_start_m, atol=1e-3)


@pytest.mark.parametrize("period_s", [0.01, 0.004, 0.025])
def test_it_goes_as_far_as_commanded(robot: LockstepRobot, period_s: float) -> None:
    begun = robot.position
    for _ in range(round(1.0 / period_s)):
        robot.move(UP, period_s)
    for _ in range(20):
        robot.move(np.zeros(6), 0.01)
    np.testing.assert_allclose(robot.position - begun, [0, 0, 0.1], atol=1e-3)


def test_twice_the_same_is_the_same(engine: str) -> None:
    ends = []
    for _ in range(2):
        robot = LockstepRobot(TASK, engine)
        for _ in range(50):
            robot.move(UP, 0.01)
        ends.append(robot.position)
        robot.close()
    np.testing.assert_array_equal(*ends)


def test_it_remembers_what_it_touched(robot: LockstepRobot) -> None:
    assert robot.touched == frozenset()
    for _ in range(300):
        robot.move(np.array([0.0, -0.1, 0.0, 0.0, 0.0, 0.0]), 0.01)
    assert "wall" in robot.touched


def test_studies_find_it_by_its_entry_point() -> None:
    (entry,) = entry_points(group="hmcs.simulated_robots", name="physics")
    assert entry.load() is LockstepRobot
