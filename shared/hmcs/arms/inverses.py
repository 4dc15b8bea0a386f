"""From a twist of the tool to joint velocities: damped inverses of the Jacobian.

Damping after Nakamura and Hanafusa (1986) and Wampler (1986). An arm of fewer than six joints
cannot do all of a twist: its tool goes where it is to go, and turns as far as the joints that are
left let it; two tasks of different priority after Nakamura, Hanafusa and Yoshikawa (1987).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hmcs.arrays import Array
from hmcs.fixtures.regions.closest import cross

FULL = 6
"""So many joints follow a twist as a whole."""
FEWEST = 3
"""So many follow its linear part."""


def smallest_singular_value(jacobians: Array) -> Any:
    """Return how well the tool is moved by the joints, (…), of Jacobians, (…, 6, n).

    The smallest singular value; of its linear part alone where there are fewer joints than six.
    """
    rows = FULL if jacobians.shape[-1] >= FULL else 3
    return np.linalg.svd(jacobians[..., :rows, :], compute_uv=False)[..., -1]


def inverse_of(jacobian: Array, damping: float) -> Inverse:
    """Return the damped inverse of a Jacobian (6, n), n at least FEWEST."""
    return (Inverse if jacobian.shape[1] >= FULL else PositionFirst)(jacobian, damping)


class Inverse:
    """The damped inverse of a Jacobian (6, n), and its null space."""

    def __init__(self, jacobian: Array, damping: float) -> None:
        left, singular, right = np.linalg.svd(jacobian)
        self.smallest = float(singular[-1])
        self._jacobian, self._damping = jacobian, damping
        self._into, self._joints = left[:, -1], right[5]
        """Of the smallest singular value: what the tool cannot do, and what the joints would."""
        self._inverse = right[:6].T @ ((singular / (singular**2 + damping**2))[:, None] * left.T)
        self._null_space = right[6:]

    def into_singularity(self, twist: Array) -> float:
        """Return the cosine between the joints' motion for `twist` and the steepest way into the
        nearest singularity; negative where it leads out.

        The joints are taken as if they were damped no more than at their fastest, 1/2λ: what
        damping holds back goes into the singularity all the same.
        """
        held_back = 1.0 / (2.0 * self._damping) - self.smallest / (
            self.smallest**2 + self._damping**2
        )
        joints = self.velocities(twist) + self._joints * float(self._into @ twist) * held_back
        steepest = -self._growth()
        size = float(np.linalg.norm(joints) * np.linalg.norm(steepest))
        return float(joints @ steepest) / size if size > 0 else 0.0

    def _growth(self) -> Array:
        """Return how the smallest singular value grows with each joint, (n,): uᵀ ∂J/∂q v.

        ∂Jᵢ/∂qⱼ is ωⱼ × (vᵢ, ωᵢ) for a joint j before i, and (ωᵢ × vⱼ, 0) for one after it.
        """
        linear, angular = self._jacobian[:3].T, self._jacobian[3:].T
        # (ω × v)·u = ω·(v × u), so that what is summed over i is crossed once.
        linear_across = cross(linear, self._into[:3])
        across = linear_across + cross(angular, self._into[3:])
        shares = self._joints[:, None]
        behind = np.cumsum((shares * across)[::-1], axis=0)[::-1]
        ahead = np.cumsum(shares * angular, axis=0) - shares * angular
        return np.asarray(np.vecdot(angular, behind) + np.vecdot(linear_across, ahead))

    def velocities(self, twist: Array) -> Array:
        """Return the joint velocities (n,) for `twist`."""
        velocities: Array = self._inverse @ twist
        return velocities

    def within_null_space(self, velocities: Array) -> Array:
        """Return the part of `velocities` that leaves the tool where it is."""
        part: Array = self._null_space.T @ (self._null_space @ velocities)
        return part


class PositionFirst(Inverse):
    """The inverse for an arm of three to five joints: linear part first, (6, n)."""

    def __init__(self, jacobian: Array, damping: float) -> None:
        linear, angular = jacobian[:3], jacobian[3:]
        left, singular, right = np.linalg.svd(linear)
        self.smallest = float(singular[-1])
        self._jacobian, self._damping = jacobian, damping
        self._into, self._joints = np.append(left[:, -1], np.zeros(3)), right[2]
        moves = right[:3].T @ ((singular / (singular**2 + damping**2))[:, None] * left.T)
        free = right[3:].T
        turning = angular @ free
        turns = free @ np.linalg.solve(
            turning.T @ turning + damping**2 * np.eye(free.shape[1]), turning.T
        )
        self._inverse = np.hstack([moves - turns @ angular @ moves, turns])
        self._null_space = np.zeros((0, jacobian.shape[1]))
