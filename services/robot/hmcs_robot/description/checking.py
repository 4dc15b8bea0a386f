"""What an arm can do, measured from its description: where its tool gets to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs_robot.description.chain import UNITS, Chain, pose_of
from hmcs_robot.description.described import DescribedArm
from hmcs_robot.driver import Pose

_POSTURES = 20_000


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
    """Return where a tool gets to; other things in the room and the arm itself aside."""
    points = chain.poses(chain.drawn(postures))[:, :3, 3]
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
                f"{chain.efforts[index]:.4g} {'N' if kind == 'prismatic' else 'N·m'}",
                ", ".join(what for what, is_missing in missing.items() if is_missing),
            )
        )
    return tuple(rows)
