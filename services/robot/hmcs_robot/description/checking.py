"""What an arm can do, measured from its description: where its tool gets to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hmcs.arms.chain import FORCES, UNITS, Chain, pose_of
from hmcs.arms.state import Pose
from hmcs.arrays import Array
from hmcs_robot.description.described import DescribedArm

_POSTURES = 20_000
_STEPS, _STEP_RAD_PER_M = 400, 0.3
"""Of the way on to where the tool gets farthest."""


class Reach(NamedTuple):
    """Where the tool gets to, of postures all over the joints' ranges."""

    points: Array
    """m, base frame, shape (k, 3)."""
    lower: Array
    """m, shape (3,): corner of the box about them."""
    upper: Array
    farthest_m: float
    """From the base."""


class JointRow(NamedTuple):
    """One joint of an arm, as it is shown."""

    name: str
    kind: str
    range: str
    speed: str
    effort: str
    assumed: str
    """What of it the file does not give; empty where it gives all."""


def reach_of(chain: Chain, postures: int = _POSTURES) -> Reach:
    """Return where a tool gets to; other things in the room and the arm itself aside.

    From the postures that get farthest along each axis, and from the base, it is led on as far as
    the joints' ranges let it.
    """
    drawn = chain.drawn(postures)
    points = chain.poses(drawn)[:, :3, 3]
    ways = np.vstack([np.eye(3), -np.eye(3)])
    far = [*(points @ ways.T).argmax(axis=0), np.linalg.norm(points, axis=1).argmax()]
    positions = drawn[far]
    lower, upper = chain.finite_range
    for _ in range(_STEPS):
        tools = chain.poses(positions)[:, :3, 3]
        onward = np.vstack([ways, tools[-1] / max(float(np.linalg.norm(tools[-1])), 1e-9)])
        slopes = np.einsum("kan,ka->kn", chain.jacobians(positions)[:, :3], onward)
        positions = np.clip(positions + _STEP_RAD_PER_M * slopes, lower, upper)
    points = np.vstack([points, chain.poses(positions)[:, :3, 3]])
    farthest_m = float(np.linalg.norm(points, axis=1).max())
    return Reach(points, points.min(axis=0), points.max(axis=0), farthest_m)


def tool_at(chain: Chain, positions: Array) -> Pose:
    """Return the pose of the tool at joint positions, (n,)."""
    return pose_of(chain.poses(positions))


def joint_rows(arm: DescribedArm) -> tuple[JointRow, ...]:
    """Return the joints of an arm from base to tool."""
    chain, rows = arm.chain, []
    for index, (name, kind) in enumerate(zip(chain.joint_names, chain.kinds, strict=True)):
        unit, given = UNITS[kind], arm.urdf.joints[name]
        turns = kind == "continuous"
        missing = {
            "range": not turns and None in (given.lower, given.upper),
            "speed": not given.speed and arm.model.joint_speed_rad_s is None,
            "effort": not given.effort,
        }
        lower, upper = chain.limits.lower[index], chain.limits.upper[index]
        rows.append(
            JointRow(
                name,
                kind,
                "without end" if turns else f"{lower:.3g} … {upper:.3g} {unit}",
                f"{chain.limits.speed[index]:.3g} {unit}/s",
                f"{chain.efforts[index]:.5g} {FORCES[kind]}",
                ", ".join(what for what, is_missing in missing.items() if is_missing),
            )
        )
    return tuple(rows)
