"""The simulated robot without a bus and without a clock: it moves on command.

For studies, which run at many times real speed: the very control and physics of the service.
"""

from __future__ import annotations

import numpy as np

from hmcs.arms.control import JointCommand, Standing, follow
from hmcs.arrays import Array
from hmcs.task import Task
from hmcs_robot.engine import AUTO
from hmcs_robot.set_up import limits_of, simulated, tuning_of
from hmcs_robot.settings import RobotSettings

PHYSICS_RATE_HZ = 200.0
"""Twice the rate of a usual operator's device, so that a sample takes a whole number of cycles."""


class LockstepRobot:
    """The robot of a task. Raises UserError where it cannot stand at the start.

    `engine` is that of the service's settings.
    """

    def __init__(self, task: Task, engine: str = AUTO) -> None:
        settings = RobotSettings(physics_rate_hz=PHYSICS_RATE_HZ, engine=engine)
        self._period_s = 1.0 / PHYSICS_RATE_HZ
        self._driver = simulated(task, settings)
        self._limits = limits_of(task, self._driver, settings)
        self._tuning = tuning_of(settings)
        self._arm = self._driver.read()
        self._posture = self._arm.joint_positions
        self._joint_command = JointCommand(np.zeros_like(self._posture), Standing(), ())
        self._behind_s = 0.0
        self._touched: set[str] = set()

    @property
    def position(self) -> Array:
        """Where the tool is, m, base frame, shape (3,)."""
        return self._arm.tool.position

    @property
    def orientation(self) -> Array:
        """How the tool is turned, x y z w, base frame, shape (4,)."""
        return self._arm.tool.orientation

    @property
    def touched(self) -> frozenset[str]:
        """Names of the obstacles that were touched so far."""
        return frozenset(self._touched)

    def move(self, twist: Array, period_s: float) -> None:
        """Follow a reference velocity, m/s and rad/s, shape (6,), for so long."""
        self._behind_s += period_s
        while self._behind_s > 0.5 * self._period_s:
            self._behind_s -= self._period_s
            self._joint_command = follow(
                self._arm,
                twist,
                self._joint_command.carried,
                self._posture,
                self._limits,
                self._tuning,
                self._period_s,
            )
            self._driver.move(self._joint_command.joint_velocities)
            self._arm = self._driver.read()
            self._touched.update(self._arm.contacts)

    def close(self) -> None:
        """End the simulation."""
        self._driver.close()
