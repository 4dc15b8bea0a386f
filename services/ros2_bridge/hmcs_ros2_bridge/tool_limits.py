"""What no command that goes to a ROS robot may exceed: speeds, accelerations, walls, regions.

What the robot says of itself is old by its delay τ, and a bound that slows the tool by k per
distance left overshoots unless k τ ≤ 1/e (ẋ(t) = −k x(t − τ)). So k follows from the delay.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array, shortened
from hmcs.fixtures.regions.forbidden import Region, clearance_m, nearby
from hmcs.fixtures.regions.keep_out import KeepOut
from hmcs.fixtures.regions.tool_shape import PlacedTool, ToolShape, tool_shape_of
from hmcs.fixtures.regions.workspace import regions_of
from hmcs.task import Task

FASTEST_BRAKING_PER_S = 8.0
"""Speed allowed per distance left, of a robot without delay."""
SLOWED_M = 0.05
"""Beyond what a tool at full speed needs to slow down before a region."""
MARGIN_M = 0.002
"""The tool is kept so far off walls and regions."""


class Limited(NamedTuple):
    """A twist within all limits."""

    twist: Array
    """m/s and rad/s, shape (6,)."""
    names: tuple[str, ...]
    """Of the limits that shape it: `speed`, `workspace`, `region`, `acceleration`."""


class ToolLimits(NamedTuple):
    """What bounds the tool in its task."""

    speed_m_s: float
    angular_speed_rad_s: float
    acceleration_m_s2: float
    angular_acceleration_rad_s2: float
    lower_m: Array
    upper_m: Array
    """Corners of the workspace, base frame, shape (3,)."""
    regions: Sequence[Region]
    tool: ToolShape
    braking_per_s: float

    def admitted(
        self, twist: Array, position: Array, orientation: Array, previous: Array, elapsed_s: float
    ) -> Limited:
        """Return `twist` (6,) as a tool at a pose may follow it, `elapsed_s` after `previous`.

        A command that is to be zero, a stop, is not held back by accelerations.
        """
        if not np.any(twist):
            return Limited(np.zeros(6), ())
        slow = _shortened(twist, self.speed_m_s, self.angular_speed_rad_s)
        eased = previous + _shortened(
            slow - previous,
            self.acceleration_m_s2 * elapsed_s,
            self.angular_acceleration_rad_s2 * elapsed_s,
        )
        # Walls and regions come last: they may brake harder.
        room = np.stack([position - self.lower_m, self.upper_m - position]) - MARGIN_M
        lower, upper = self.braking_per_s * np.maximum(room, 0.0)
        walled = np.concatenate([np.clip(eased[:3], -lower, upper), eased[3:]])
        clear = self._kept_out(walled, PlacedTool(self.tool, position, orientation))
        stages = (twist, slow, eased, walled, clear)
        names = ("speed", "acceleration", "workspace", "region")
        shaped = zip(names, stages, stages[1:], strict=False)
        return Limited(clear, tuple(n for n, before, after in shaped if (before != after).any()))

    def clearance_m(self, position: Array, orientation: Array) -> float | None:
        """Return how far the tool is from the nearest region; None where there is none."""
        if not self.regions:
            return None
        return clearance_m(self.regions, PlacedTool(self.tool, position, orientation))

    def _kept_out(self, twist: Array, tool: PlacedTool) -> Array:
        if not self.regions:
            return twist
        near = nearby(self.regions, tool, self.speed_m_s / self.braking_per_s + SLOWED_M)
        near = near._replace(distances=near.distances - MARGIN_M)
        return KeepOut(near, 1.0 / self.braking_per_s).admitted(twist)


def tool_limits_of(
    task: Task, delay_s: float, acceleration_m_s2: float, angular_acceleration_rad_s2: float
) -> ToolLimits:
    """Return what bounds the tool of a task, of a robot with a delay.

    Raises RegionError for a forbidden region that cannot be.
    """
    return ToolLimits(
        task.robot.speed_limit_m_s,
        task.robot.angular_speed_limit_rad_s,
        acceleration_m_s2,
        angular_acceleration_rad_s2,
        np.array(task.workspace.lower_m),
        np.array(task.workspace.upper_m),
        regions_of(task),
        tool_shape_of(task),
        braking_for(delay_s),
    )


def braking_for(delay_s: float) -> float:
    """Return the speed allowed per distance left, 1/s, that does not overshoot after a delay."""
    return min(FASTEST_BRAKING_PER_S, 1.0 / (math.e * delay_s))


def _shortened(twist: Array, linear: float, angular: float) -> Array:
    return np.concatenate([shortened(twist[:3], linear), shortened(twist[3:], angular)])
