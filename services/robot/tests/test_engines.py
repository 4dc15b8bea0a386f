"""Engines: which there are, and that it makes no difference which of them moves the arm."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint, EntryPoints
from typing import Any

import numpy as np
import pytest

from hmcs.arms.state import Pose
from hmcs.errors import UserError
from hmcs.task import ForbiddenRegion, Obstacle, load_task
from hmcs_robot import engine as engines
from hmcs_robot.engine import PREFERRED, Engine, engine_named
from hmcs_robot.lockstep import LockstepRobot
from hmcs_robot.simulation import Scene, Simulation

both = pytest.mark.skipif(
    sys.version_info >= (3, 12), reason="PyBullet has no wheels for this Python"
)
ALIKE_M = 5e-5
"""Two engines bring the tool to the same place within this, at any time."""


def installed(monkeypatch: pytest.MonkeyPatch, **engines_: str) -> None:
    """Let there be these entry points and no others."""
    found = EntryPoints(
        EntryPoint(name, value, engines.ENTRY_POINTS) for name, value in engines_.items()
    )
    monkeypatch.setattr(engines, "entry_points", lambda group: found)


HERE = f"{__name__}:installed"
MISSING = "no_such_package:Engine"


@pytest.mark.parametrize(
    ("there", "asked", "taken"),
    [
        ({"mujoco": HERE, "pybullet": HERE}, "auto", "pybullet"),
        ({"mujoco": HERE, "pybullet": MISSING}, "auto", "mujoco"),
        ({"mujoco": HERE}, "auto", "mujoco"),
        ({"mujoco": HERE, "pybullet": HERE}, "mujoco", "mujoco"),
        ({"another": HERE, "mujoco": HERE}, "another", "another"),
        ({"another": HERE}, "auto", "another"),
    ],
)
def test_auto_is_the_first_that_is_installed_and_a_name_is_that_engine(
    monkeypatch: pytest.MonkeyPatch, there: dict[str, str], asked: str, taken: str
) -> None:
    monkeypatch.setitem(sys.modules, __name__, sys.modules[__name__])
    installed(monkeypatch, **there)
    assert engine_named(asked)[0] == taken


@pytest.mark.parametrize(
    ("there", "asked", "expected"),
    [
        ({"mujoco": HERE}, "bullet", "expected one of auto, mujoco, pybullet"),
        ({"mujoco": HERE}, "pybullet", "install hmcs-robot-pybullet on CPython 3.11"),
        ({"mujoco": MISSING}, "mujoco", "install hmcs-robot-mujoco"),
        ({}, "auto", "install hmcs-robot-mujoco"),
    ],
)
def test_an_engine_that_is_not_there_is_refused_with_what_to_install(
    monkeypatch: pytest.MonkeyPatch, there: dict[str, str], asked: str, expected: str
) -> None:
    installed(monkeypatch, **there)
    with pytest.raises(UserError, match=expected):
        engine_named(asked)


def paths(task_name: str, cycles: int = 240) -> list[np.ndarray]:
    """Return where each engine brings the tool by the same commands, (cycles, 3) of each."""
    found = []
    for name in PREFERRED:
        robot = LockstepRobot(load_task(task_name), name)
        path = []
        for cycle in range(cycles):
            a = cycle / 60
            twist = [0.1 * np.cos(a), 0.15 * np.sin(1.3 * a), 0.1 * np.sin(a), 0.2, 0.0, 0.1]
            robot.move(np.array(twist), 0.01)
            path.append(robot.position)
        robot.close()
        found.append(np.array(path))
    return found


@both
@pytest.mark.parametrize("task", ["human-shapes", "lines-through-obstacles"])
def test_the_tool_takes_the_same_path_with_both_engines(task: str) -> None:
    one, other = paths(task)
    assert np.ptp(one, axis=0).max() > 0.1
    assert np.linalg.norm(one - other, axis=1).max() < ALIKE_M


AROUND: dict[str, Any] = {
    "sphere": {"shape": "sphere", "position_m": [0.25, 0.35, 0.55], "radius_m": 0.1},
    "box": {"shape": "box", "position_m": [0.25, 0.4, 0.55], "size_m": [0.3, 0.2, 0.3]},
    "capsule": {
        "shape": "capsule",
        "position_m": [0.25, 0.4, 0.2],
        "end_m": [0.25, 0.4, 0.9],
        "radius_m": 0.1,
    },
    "plane": {"shape": "plane", "position_m": [0, 0.35, 0], "normal": [0, -1, 0]},
}
OBSTACLES = (
    Obstacle(name="ball", shape="sphere", position_m=(0.62, 0, 0.65), radius_m=0.04),
    Obstacle(name="wall", shape="box", position_m=(0.60, 0.3, 0.50), size_m=(0.3, 0.1, 0.3)),
)


@pytest.fixture
def cells(starts: dict[str, Pose], robot: str) -> Iterator[list[Simulation]]:
    """The same arm in the same cell, with each engine."""
    regions = tuple(
        ForbiddenRegion.model_validate({"name": name, **fields}) for name, fields in AROUND.items()
    )
    made = [
        Simulation(Scene(robot, starts[robot], OBSTACLES, regions), 1 / 240, engine=name)
        for name in PREFERRED
    ]
    yield made
    for each in made:
        each.close()


def nearest_m(engine: Engine) -> dict[tuple[str, str], float]:
    """Return how near each link is to what it is near, by their names."""
    found: dict[tuple[str, str], float] = {}
    for near in (*engine.near_obstacles(0.15), *engine.near_regions(0.08)):
        key = engine.link_name(near.link), near.name
        found[key] = min(found.get(key, np.inf), float(near.distances_m.min()))
    return found


@both
def test_engines_agree_on_limits_and_distances(cells: list[Simulation]) -> None:
    one, other = cells
    assert one.joint_names == other.joint_names
    for mine, theirs in zip(one.limits, other.limits, strict=True):
        np.testing.assert_allclose(mine, theirs)
    random = np.random.default_rng(5)
    compared = 0
    for _ in range(60):
        posture = one.home + random.uniform(-0.8, 0.8, len(one.home))
        posture = np.clip(posture, one.limits.lower, one.limits.upper)
        for each in cells:
            each.engine.place(posture)
        mine, theirs = (nearest_m(each.engine) for each in cells)
        for key in mine.keys() & theirs.keys():
            compared += 1
            if mine[key] > 0.0:
                # PyBullet grows meshes by its collision margin, 1 mm.
                assert mine[key] == pytest.approx(theirs[key], abs=1.2e-3), key
            else:
                assert theirs[key] < 1.2e-3
    assert compared > 60


@both
def test_both_stop_at_the_same_obstacle_at_the_same_place() -> None:
    ends, names = [], []
    for name in PREFERRED:
        robot = LockstepRobot(load_task("lines-through-obstacles"), name)
        for _ in range(300):
            robot.move(np.array([0.0, -0.1, 0.0, 0.0, 0.0, 0.0]), 0.01)
        ends.append(robot.position)
        names.append(robot.touched)
        robot.close()
    assert names[0] == names[1] != frozenset()
    assert np.linalg.norm(ends[0] - ends[1]) < 2e-3
