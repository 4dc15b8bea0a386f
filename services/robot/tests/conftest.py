from __future__ import annotations

import sys
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from hmcs.arms.control import Following, JointCommand, Standing, Tuning, follow
from hmcs.arms.limits import Limits
from hmcs.arms.state import Pose
from hmcs.task import Obstacle
from hmcs_robot.engine import PREFERRED, Cell, Engine, engine_named
from hmcs_robot.robots import ROBOTS
from hmcs_robot.simulation import Scene, Simulation
from support.arms import limits_about

PERIOD_S = 1 / 240
STARTS = {
    "puma560": Pose(np.array([0.60, 0.0, 0.50]), np.array([0, 0.5**0.5, 0, 0.5**0.5])),
    "iiwa": Pose(np.array([0.60, 0.0, 0.45]), np.array([0, 0.5**0.5, 0, 0.5**0.5])),
    "panda": Pose(
        np.array([0.55, 0.0, 0.50]), np.array([0, 0.9238795325112867, 0, 0.3826834323650898])
    ),
}


class Bench:
    """A simulated arm with limits, driven cycle by cycle without a bus."""

    def __init__(self, simulation: Simulation, limits: Limits) -> None:
        self.simulation = simulation
        self.limits = limits
        self.tuning = Tuning()
        self.carried: Following | Standing = Standing()

    def follow(self, twist: np.ndarray) -> JointCommand:
        """Follow `twist` for one cycle."""
        motion = follow(
            self.simulation.read(),
            np.asarray(twist, dtype=float),
            self.carried,
            self.simulation.home,
            self.limits,
            self.tuning,
            PERIOD_S,
        )
        self.carried = motion.carried
        self.simulation.move(motion.joint_velocities)
        return motion


@pytest.fixture
def starts() -> dict[str, Pose]:
    return STARTS


@pytest.fixture
def period_s() -> float:
    return PERIOD_S


@pytest.fixture(params=PREFERRED)
def engine(request: pytest.FixtureRequest) -> str:
    """The name of an engine, each in turn."""
    if request.param == "pybullet" and sys.version_info >= (3, 12):
        pytest.skip("PyBullet has no wheels for this Python")
    return str(request.param)


@pytest.fixture
def bench(engine: str) -> Iterator[Callable[..., Bench]]:
    """Make a bench: robot, half size of the workspace (m) around the start, obstacles."""
    made = []

    def make(
        robot: str = "puma560", half_m: float = 0.3, obstacles: tuple[Obstacle, ...] = ()
    ) -> Bench:
        start = STARTS[robot]
        simulation = Simulation(Scene(robot, start, obstacles), PERIOD_S, engine=engine)
        made.append(simulation)
        limits = limits_about(simulation.limits, start.position, half_m)
        return Bench(simulation, limits)

    yield make
    for simulation in made:
        simulation.close()


@pytest.fixture(params=sorted(ROBOTS))
def robot(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def arm(robot: str, engine: str) -> Iterator[Engine]:
    """An arm alone in its cell."""
    _, opens = engine_named(engine)
    made = opens(Cell(ROBOTS[robot], (), ()), PERIOD_S, gui=False)
    yield made
    made.close()
