"""The robot at the end of the loop: a lag, or the physics of its simulation.

A distribution that simulates a robot in process names it in its `pyproject.toml`:

    [project.entry-points."hmcs.simulated_robots"]
    physics = "hmcs_robot.lockstep:LockstepRobot"
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Protocol

import numpy as np

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.task import Task
from hmcs.task.values import unknown_name_message

ENTRY_POINTS = "hmcs.simulated_robots"
LAG = "lag"


class SimulatedRobot(Protocol):
    """A robot that moves on command."""

    @property
    def position(self) -> Array:
        """Where the tool is, m, base frame, shape (3,)."""

    @property
    def orientation(self) -> Array:
        """How the tool is turned, x y z w, base frame, shape (4,)."""

    @property
    def touched(self) -> frozenset[str]:
        """Names of the obstacles that were touched so far."""

    def move(self, twist: Array, period_s: float) -> None:
        """Follow a reference velocity, m/s and rad/s, shape (6,), for so long."""

    def close(self) -> None:
        """End the simulation."""


class LaggingTool:
    """A tool alone, whose velocity follows with a first-order lag; nothing is in its way."""

    def __init__(self, start: Array, orientation: Array, lag_s: float) -> None:
        """Begin at `start`, m, shape (3,), with a time constant of `lag_s`."""
        self._position = np.array(start, dtype=float)
        self.orientation = np.array(orientation, dtype=float)
        self._velocity = np.zeros(3)
        self._lag_s = lag_s

    @property
    def position(self) -> Array:
        """See `SimulatedRobot`."""
        return self._position

    @property
    def touched(self) -> frozenset[str]:
        """See `SimulatedRobot`."""
        return frozenset()

    def move(self, twist: Array, period_s: float) -> None:
        """See `SimulatedRobot`."""
        follow = 1.0 - float(np.exp(-period_s / self._lag_s)) if self._lag_s > 0 else 1.0
        self._velocity = self._velocity + follow * (twist[:3] - self._velocity)
        self._position = self._position + self._velocity * period_s

    def close(self) -> None:
        """Nothing is held."""


def robot_of(task: Task, name: str, lag_s: float) -> SimulatedRobot:
    """Return the robot of a task: `lag`, or the name of an installed simulation.

    Raises UserError for a name that is none, and as the simulation does.
    """
    if name == LAG:
        start, turned = task.robot.tool_start_m, task.robot.tool_orientation_xyzw
        return LaggingTool(np.array(start), np.array(turned), lag_s)
    others = {entry.name: entry for entry in entry_points(group=ENTRY_POINTS)}
    if name not in others:
        raise UserError(unknown_name_message("robot", name, [LAG, *others]))
    made: SimulatedRobot = others[name].load()(task)
    return made
