"""What no command may exceed: speeds, accelerations, walls, joint ranges, contacts.

Limits on the twist come first and keep or turn it as its sender would expect. Bounds on the joint
velocities come last, are linear, and always admit standing still.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hmcs.arms.state import ArmState, JointLimits
from hmcs.arrays import Array, shortened
from hmcs.fixtures.regions.closest import cross
from hmcs.fixtures.regions.forbidden import NOTHING, Candidates
from hmcs.fixtures.regions.keep_out import KeepOut

_NOTHING = 1e-6
"""A bound approached more slowly than this (rad/s, m/s) is not approached."""
JOINT_SPEED = "joint_speed"
_PRESSING_M_S = 1e-4
"""A contact that closes more slowly than this counts as sliding."""


@dataclass(frozen=True, kw_only=True)
class ToolLimits:
    """What no command to a tool may exceed."""

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


@dataclass(frozen=True, kw_only=True)
class Limits(ToolLimits):
    """What no command to an arm may exceed: the limits of its tool and of its joints."""

    joints: JointLimits
    joint_margin_rad: float = 0.01
    link_margin_m: float = 0.001
    """Links of the arm are kept so far off forbidden regions."""


def within_speed(twist: Array, limits: ToolLimits) -> Array:
    """Return `twist` (6,), its linear and its angular part each shortened to the speed limits."""
    return np.concatenate(
        [
            shortened(twist[:3], limits.speed_m_s),
            shortened(twist[3:], limits.angular_speed_rad_s),
        ]
    )


def within_acceleration(
    twist: Array, previous: Array, limits: ToolLimits, period_s: float
) -> Array:
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


def within_walls(twist: Array, position: Array, limits: ToolLimits) -> Array:
    """Return `twist` (6,) of a tool at `position`, slowed where it leads out through a wall."""
    lower, upper = _room(position, limits, limits.wall_margin_m)
    braking_per_s = limits.braking_per_s
    slowed = np.minimum(np.maximum(twist[:3], -braking_per_s * lower), braking_per_s * upper)
    return np.concatenate([slowed, twist[3:]])


def within_planes(twist: Array, planes: Candidates, limits: ToolLimits) -> Array:
    """Return the twist nearest to `twist` (6,) that brings no corner of the tool behind a plane.

    A corner approaches a plane no faster than its distance times `braking_per_s`.
    """
    return KeepOut(planes, 1.0 / limits.braking_per_s).admitted(twist)


def _room(position: Array, limits: ToolLimits, margin_m: float) -> tuple[Array, Array]:
    """Return the distance to the lower and the upper walls, m, (3,) each, never negative."""
    below = position - limits.workspace_lower_m - margin_m
    above = limits.workspace_upper_m - position - margin_m
    return np.maximum(below, 0.0), np.maximum(above, 0.0)


class Bounds(NamedTuple):
    """What joint velocities v may be: `rows` v ≤ `most`, which v = 0 always fulfills."""

    rows: Array
    """Shape (m, n)."""
    most: Array
    """Shape (m,)."""
    names: tuple[str, ...]
    """What each row is of, m of them."""

    @property
    def hard(self) -> Bounds:
        """Those that must hold at once: all but the joints' speeds."""
        kept = [row for row, name in enumerate(self.names) if name != JOINT_SPEED]
        return Bounds(self.rows[kept], self.most[kept], tuple(self.names[row] for row in kept))

    def scale(self, base: Array, more: Array) -> tuple[float, tuple[str, ...]]:
        """Return the largest s, 0 to 1, for which `base` + s `more` is within the bounds, and the
        names of the bounds that hold it below 1.
        """
        asked = self.rows @ more
        ratios = np.full_like(asked, np.inf)
        np.divide(self.most - self.rows @ base, asked, out=ratios, where=asked > _NOTHING)
        names = tuple(self.names[row] for row in np.flatnonzero(ratios < 1.0 - 1e-9).tolist())
        return float(np.clip(ratios.min(), 0.0, 1.0)), names


def bounds_of(arm: ArmState, limits: Limits, planes: Candidates = NOTHING) -> Bounds:
    """Return the bounds of joint ranges, joint speeds, walls, planes, nearby links and contacts.

    The walls and planes are asked again here, now of the motion the joints really make: near a
    singularity damping mixes the parts of a twist.
    """
    joints, at = limits.joints, arm.joint_positions
    each = np.eye(len(at))
    to_end = np.concatenate([joints.upper - at, at - joints.lower]) - limits.joint_margin_rad
    to_wall = _room(arm.tool.position, limits, 0.0)
    linear, angular = arm.jacobian[:3], arm.jacobian[3:]
    # A corner at a lever r from the tool moves at v + ω × r, so that n·(ω × r) = (r × n)·ω.
    toward_planes = -(planes.normals @ linear + cross(planes.levers, planes.normals) @ angular)
    parts = [
        (each, limits.braking_per_s * np.maximum(to_end[: len(at)], 0.0), None),
        (-each, limits.braking_per_s * np.maximum(to_end[len(at) :], 0.0), None),
        (each, joints.speed, JOINT_SPEED),
        (-each, joints.speed, JOINT_SPEED),
        (-linear, limits.braking_per_s * to_wall[0], "workspace"),
        (linear, limits.braking_per_s * to_wall[1], "workspace"),
        (toward_planes, limits.braking_per_s * np.maximum(planes.distances, 0.0), "region"),
        *(
            (
                -near.separation_per_joint,
                limits.braking_per_s * np.maximum(near.distances_m - limits.link_margin_m, 0.0),
                "region",
            )
            for near in arm.links_near
        ),
        *(
            (-touch.separation_per_joint[None], np.array([_PRESSING_M_S]), "contact")
            for touch in arm.touches
        ),
    ]
    return Bounds(
        np.vstack([rows for rows, _, _ in parts]),
        np.concatenate([most for _, most, _ in parts]),
        tuple(name or f"joint_{row + 1}" for rows, _, name in parts for row in range(len(rows))),
    )


def speed_scale(twist: Array, limits: ToolLimits) -> float:
    """Return the factor, 0 to 1, that brings `twist` (6,) within the speed limits as a whole."""
    linear, angular = float(np.linalg.norm(twist[:3])), float(np.linalg.norm(twist[3:]))
    return 1.0 / max(1.0, linear / limits.speed_m_s, angular / limits.angular_speed_rad_s)
