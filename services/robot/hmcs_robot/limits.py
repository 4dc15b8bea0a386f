"""What no command may exceed: speeds, accelerations, walls, joint ranges, contacts.

Limits on the twist come first and keep or turn it as its sender would expect. Bounds on the joint
velocities come last, are linear, and always admit standing still.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hmcs_robot.driver import ArmState, Array, JointLimits

_NOTHING = 1e-6
"""A bound approached more slowly than this (rad/s, m/s) is not approached."""
_PRESSING_M_S = 1e-4
"""A contact that closes more slowly than this counts as sliding."""


@dataclass(frozen=True)
class Limits:
    """What no command may exceed."""

    joints: JointLimits
    speed_m_s: float
    angular_speed_rad_s: float
    workspace_lower_m: Array
    """Corner of the box the tool stays in, shape (3,)."""
    workspace_upper_m: Array
    acceleration_m_s2: float = 10.0
    """Of the reference while following; a stop is not held back by it."""
    angular_acceleration_rad_s2: float = 20.0
    braking_per_s: float = 8.0
    """Speed allowed per distance left to a wall of the workspace or the end of a joint's range."""
    wall_margin_m: float = 0.002
    joint_margin_rad: float = 0.01


def within_speed(twist: Array, limits: Limits) -> Array:
    """Return `twist` (6,), its linear and its angular part each shortened to the speed limits."""
    return np.concatenate(
        [
            shortened(twist[:3], limits.speed_m_s),
            shortened(twist[3:], limits.angular_speed_rad_s),
        ]
    )


def within_acceleration(twist: Array, previous: Array, limits: Limits, period_s: float) -> Array:
    """Return how far towards `twist` (6,) the `previous` one may change within a period."""
    change = twist - previous
    step = np.concatenate(
        [
            shortened(change[:3], limits.acceleration_m_s2 * period_s),
            shortened(change[3:], limits.angular_acceleration_rad_s2 * period_s),
        ]
    )
    reached: Array = previous + step
    return reached


def within_walls(twist: Array, position: Array, limits: Limits) -> Array:
    """Return `twist` (6,) of a tool at `position`, slowed where it leads out through a wall."""
    lower, upper = limits.braking_per_s * _room(position, limits, limits.wall_margin_m)
    return np.concatenate([np.clip(twist[:3], -lower, upper), twist[3:]])


def _room(position: Array, limits: Limits, margin_m: float) -> Array:
    """Return the distance to the lower and the upper walls, m, shape (2, 3), never negative."""
    room = np.stack([position - limits.workspace_lower_m, limits.workspace_upper_m - position])
    return np.maximum(room - margin_m, 0.0)


def shortened(vector: Array, length: float) -> Array:
    """Return `vector` cut to `length` at most, in its direction, however large it is."""
    largest = float(np.abs(vector).max())
    if largest == 0.0:
        return vector
    shape = vector / largest
    norm = float(np.linalg.norm(shape))
    if largest <= length / norm:
        return vector
    cut: Array = shape * (length / norm)
    return cut


class Bounds(NamedTuple):
    """What joint velocities v may be: `rows` v ≤ `most`, which v = 0 always fulfills."""

    rows: Array
    """Shape (m, n)."""
    most: Array
    """Shape (m,)."""
    joints: int

    def scale(self, base: Array, more: Array) -> tuple[float, tuple[str, ...]]:
        """Return the largest s, 0 to 1, for which `base` + s `more` is within the bounds, and the
        names of the bounds that hold it below 1.
        """
        asked = self.rows @ more
        ratios = np.full_like(asked, np.inf)
        np.divide(self.most - self.rows @ base, asked, out=ratios, where=asked > _NOTHING)
        names = tuple(self._name(row) for row in np.flatnonzero(ratios < 1.0 - 1e-9).tolist())
        return float(np.clip(ratios.min(), 0.0, 1.0)), names

    def _name(self, row: int) -> str:
        kind, joint = divmod(row, self.joints)
        if kind < 2:
            return f"joint_{joint + 1}"
        if kind < 4:
            return "joint_speed"
        return "workspace" if row < 4 * self.joints + 6 else "contact"


def bounds_of(arm: ArmState, limits: Limits) -> Bounds:
    """Return the bounds of joint ranges, joint speeds, walls and contacts.

    The walls are asked again here, now of the motion the joints really make: near a singularity
    damping mixes the parts of a twist.
    """
    joints, at = limits.joints, arm.joint_positions
    each = np.eye(len(at))
    to_end = np.concatenate([joints.upper - at, at - joints.lower]) - limits.joint_margin_rad
    to_wall = _room(arm.tool.position, limits, 0.0)
    linear = arm.jacobian[:3]
    return Bounds(
        np.vstack(
            [each, -each, each, -each, -linear, linear]
            + [-touch.separation_per_joint for touch in arm.touches]
        ),
        np.concatenate(
            [
                limits.braking_per_s * np.maximum(to_end, 0.0),
                joints.speed,
                joints.speed,
                limits.braking_per_s * to_wall.ravel(),
                np.full(len(arm.touches), _PRESSING_M_S),
            ]
        ),
        len(at),
    )


def speed_scale(twist: Array, limits: Limits) -> float:
    """Return the factor, 0 to 1, that brings `twist` (6,) within the speed limits as a whole."""
    linear, angular = float(np.linalg.norm(twist[:3])), float(np.linalg.norm(twist[3:]))
    return 1.0 / max(1.0, linear / limits.speed_m_s, angular / limits.angular_speed_rad_s)
