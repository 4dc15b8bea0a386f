"""What no command that goes to a ROS robot may exceed: speeds, accelerations, walls, regions.

What the robot says of itself is old by its delay τ, and a bound that slows the tool by k per
distance left overshoots unless k τ ≤ 1/e (ẋ(t) = −k x(t − τ)). So k follows from the delay.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hmcs.arms.fence import Fence
from hmcs.arms.limits import (
    ToolLimits,
    within_acceleration,
    within_planes,
    within_speed,
    within_walls,
)
from hmcs.arms.state import Pose
from hmcs.arrays import Array
from hmcs.fixtures.regions.tool_shape import tool_shape_of
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


def admitted(
    twist: Array, tool: Pose, before: Array, limits: ToolLimits, fence: Fence, elapsed_s: float
) -> Limited:
    """Return `twist` (6,) as a tool at a pose may follow it, `elapsed_s` after `before`.

    A command that is to be zero, a stop, is not held back by accelerations.
    """
    if not twist.any():
        return Limited(np.zeros(6), ())
    slow = within_speed(twist, limits)
    eased = within_acceleration(slow, before, limits, elapsed_s)
    # Walls and regions come last: they may brake harder.
    walled = within_walls(eased, tool.position, limits)
    clear = within_planes(walled, fence.planes(tool), limits) if fence.regions else walled
    # As lists: to compare arrays of six takes longer than all of the above.
    stages = [stage.tolist() for stage in (twist, slow, eased, walled, clear)]
    names = ("speed", "acceleration", "workspace", "region")
    shaped = zip(names, stages, stages[1:], strict=False)
    return Limited(clear, tuple(name for name, one, other in shaped if one != other))


def tool_limits_of(
    task: Task, delay_s: float, acceleration_m_s2: float, angular_acceleration_rad_s2: float
) -> ToolLimits:
    """Return what bounds the tool of a task, of a robot with a delay."""
    return ToolLimits(
        speed_m_s=task.robot.speed_limit_m_s,
        angular_speed_rad_s=task.robot.angular_speed_limit_rad_s,
        workspace_lower_m=np.array(task.workspace.lower_m),
        workspace_upper_m=np.array(task.workspace.upper_m),
        acceleration_m_s2=acceleration_m_s2,
        angular_acceleration_rad_s2=angular_acceleration_rad_s2,
        braking_per_s=braking_for(delay_s),
        wall_margin_m=MARGIN_M,
    )


def fence_of(task: Task, limits: ToolLimits) -> Fence:
    """Return the forbidden regions of a task; raises RegionError for one that cannot be."""
    reach_m = limits.speed_m_s / limits.braking_per_s + SLOWED_M
    return Fence(regions_of(task), tool_shape_of(task), reach_m, MARGIN_M)


def braking_for(delay_s: float) -> float:
    """Return the speed allowed per distance left, 1/s, that does not overshoot after a delay."""
    return min(FASTEST_BRAKING_PER_S, 1.0 / (math.e * delay_s))
