"""Inverse kinematics: the joint positions that bring a tool to a pose."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from hmcs.arms.inverses import FULL, inverse_of, smallest_singular_value
from hmcs.arms.state import JointLimits, Pose
from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.motion import quaternions

_ACCURACY_M = 1e-6
_ITERATIONS = 150
_TRIES = 24
_LARGEST_STEP_RAD = 0.3
_DAMPING = 0.01
_AS_WELL_TURNED_RAD = 0.01
"""Postures of an arm of few joints that differ by less in their angle are equally good."""
_COMFORTABLE_MANIPULABILITY = 0.1
_COMFORTABLE_RAD = 0.3
"""A joint further than this from the ends of its range counts as free."""


class Kinematics(Protocol):
    """An arm that can be put anywhere."""

    limits: JointLimits

    def place(self, joint_positions: Array) -> None:
        """Put the arm at `joint_positions`, rad, shape (n,)."""
        ...

    def tool(self) -> Pose:
        """Return the pose of the tool there."""
        ...

    def jacobian(self, joint_positions: Array) -> Array:
        """Return the Jacobian of the tool, shape (6, n)."""
        ...


class UnreachablePoseError(UserError):
    """The robot cannot bring its tool to a pose."""


class _Solution(NamedTuple):
    joint_positions: Array
    distance_m: float
    angle_rad: float


def inverse_kinematics(arm: Kinematics, robot: str, target: Pose, home: Array) -> Array:
    """Return the joint positions, rad, shape (n,), that bring the tool to `target`.

    They are within their limits. The solution found from `home` is taken where it is comfortable:
    far from singularities and from the ends of the joints' ranges. Otherwise the most comfortable
    one near `home` is, of those found from postures drawn at random (always the same ones). An arm
    of fewer than six joints has its tool at the position, turned as nearly as it can be.

    Raises UnreachablePoseError, which names the pose, the robot and the distance short.
    """
    limits = arm.limits
    first = _descend(arm, target, home)
    few = len(home) < FULL
    if not few and _reached(first) and _is_comfortable(arm, first.joint_positions):
        return first.joint_positions
    random = np.random.default_rng(0)
    # A joint that turns without end is tried within a turn.
    lower = np.where(np.isfinite(limits.lower), limits.lower, -np.pi)
    upper = np.where(np.isfinite(limits.upper), limits.upper, np.pi)
    starts = random.uniform(lower, upper, (_TRIES, len(home)))
    found = [first, *(_descend(arm, target, start) for start in starts)]
    reached = [solution for solution in found if _reached(solution)]
    if not reached:
        nearest = min(found, key=lambda s: s.distance_m + 0.1 * s.angle_rad)
        raise UnreachablePoseError(
            f"robot {robot} cannot bring its tool to position {_text(target.position)} m with "
            f"orientation {_text(target.orientation)} (x y z w): it stays "
            f"{nearest.distance_m:.3f} m and {np.degrees(nearest.angle_rad):.0f}° short. Choose a "
            "tool_start_m and tool_orientation_xyzw within its reach, or another robot model"
        )
    if few:
        least_rad = min(solution.angle_rad for solution in reached)
        reached = [each for each in reached if each.angle_rad < least_rad + _AS_WELL_TURNED_RAD]
    return max(reached, key=lambda s: _comfort(arm, s.joint_positions, home)).joint_positions


def _descend(arm: Kinematics, target: Pose, start: Array) -> _Solution:
    positions = start
    for _ in range(_ITERATIONS):
        arm.place(positions)
        tool = arm.tool()
        error = np.concatenate(
            [
                target.position - tool.position,
                quaternions.between(tool.orientation, target.orientation),
            ]
        )
        if float(np.abs(error).max()) < _ACCURACY_M:
            break
        step = inverse_of(arm.jacobian(positions), _DAMPING).velocities(error)
        step = step * min(1.0, _LARGEST_STEP_RAD / max(float(np.abs(step).max()), 1e-12))
        positions = np.clip(positions + step, arm.limits.lower, arm.limits.upper)
    return _Solution(positions, float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:])))


def _reached(solution: _Solution) -> bool:
    turned = solution.angle_rad < 1e-4 or len(solution.joint_positions) < FULL
    return solution.distance_m < 1e-5 and turned


def _is_comfortable(arm: Kinematics, positions: Array) -> bool:
    return (
        _manipulability(arm, positions) > _COMFORTABLE_MANIPULABILITY
        and _to_ends(arm, positions) > _COMFORTABLE_RAD
    )


def _comfort(arm: Kinematics, positions: Array, home: Array) -> float:
    room = min(_to_ends(arm, positions), _COMFORTABLE_RAD)
    away = float(np.abs(positions - home).max())
    return _manipulability(arm, positions) + 0.5 * room - 0.1 * away


def _manipulability(arm: Kinematics, positions: Array) -> float:
    return float(smallest_singular_value(arm.jacobian(positions)))


def _to_ends(arm: Kinematics, positions: Array) -> float:
    """Return the smallest distance of a joint to an end of its range, rad."""
    return float(np.minimum(positions - arm.limits.lower, arm.limits.upper - positions).min())


def _text(values: Array) -> str:
    return "(" + ", ".join(f"{value:.3f}" for value in values) + ")"
