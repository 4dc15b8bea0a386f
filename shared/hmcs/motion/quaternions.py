"""Orientations: unit quaternions x y z w, of which q and −q are the same rotation."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

UNIT_WITHIN = 1e-3
"""A quaternion whose length differs from one by more is no rotation."""


def is_unit(quaternion: Iterable[float]) -> bool:
    """Return whether a quaternion, shape (4,), is of unit length but for rounding."""
    return abs(math.hypot(*quaternion) - 1.0) <= UNIT_WITHIN


def unit_quaternion(value: ArrayLike) -> FloatArray:
    """Return `value`, shape (4,), with what rounding has done to its length undone.

    Raises ValueError when it is not four finite numbers of unit length.
    """
    quaternion = np.array(value, dtype=float)
    if quaternion.shape != (4,) or not is_unit(quaternion):
        raise ValueError(
            f"orientation is {value!r}, expected a unit quaternion x y z w: four finite numbers"
        )
    return np.asarray(quaternion / math.hypot(*quaternion))


def nearer(quaternion: FloatArray, to: FloatArray) -> FloatArray:
    """Return the same rotation with the sign that is nearer to another, shapes (4,)."""
    return -quaternion if float(quaternion @ to) < 0 else quaternion


def continuous(quaternions: ArrayLike) -> FloatArray:
    """Return the same rotations, shape (T, 4), each with the sign nearer to the one before."""
    given = np.asarray(quaternions, dtype=float)
    flips = (given[1:] * given[:-1]).sum(axis=1) < 0
    turned = np.concatenate([[False], np.logical_xor.accumulate(flips)])[: len(given)]
    return np.where(turned[:, None], -given, given)


def rotation_matrix(quaternion: ArrayLike) -> FloatArray:
    """Return the rotation of a unit quaternion x y z w as a matrix, shape (3, 3).

    Raises ValueError as `unit_quaternion` does.
    """
    x, y, z, w = unit_quaternion(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def turn_rad(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return the rotation vector, rad, from one orientation to another, in the base frame.

    Both are unit quaternions x y z w, shape (4,).
    """
    u, v = after[:3], before[:3]
    real = float(after @ before)
    axis = before[3] * u - after[3] * v - np.cross(u, v)
    if real < 0:
        real, axis = -real, -axis
    size = float(np.linalg.norm(axis))
    return np.asarray(2.0 * math.atan2(size, real) * axis / size if size > 0 else axis)
