"""Orientations: unit quaternions x y z w, of which q and −q are the same rotation."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from hmcs.arrays import Array

UNIT_WITHIN = 1e-3
"""A quaternion whose length differs from one by more is no rotation."""


def is_unit(quaternion: Iterable[float]) -> bool:
    """Return whether a quaternion, shape (4,), is of unit length but for rounding."""
    return abs(math.hypot(*quaternion) - 1.0) <= UNIT_WITHIN


def unit_quaternion(value: ArrayLike) -> Array:
    """Return `value`, shape (4,), with what rounding has done to its length undone.

    Raises ValueError when it is not four finite numbers of unit length.
    """
    quaternion = np.array(value, dtype=float)
    if quaternion.shape != (4,) or not is_unit(quaternion):
        raise ValueError(
            f"orientation is {value!r}, expected a unit quaternion x y z w: four finite numbers"
        )
    return np.asarray(quaternion / math.hypot(*quaternion))


def nearer(quaternion: Array, to: Array) -> Array:
    """Return the same rotation with the sign that is nearer to another, shapes (4,)."""
    return -quaternion if float(quaternion @ to) < 0 else quaternion


def continuous(quaternions: ArrayLike) -> Array:
    """Return the same rotations, shape (T, 4), each with the sign nearer to the one before."""
    given = np.asarray(quaternions, dtype=float)
    flips = (given[1:] * given[:-1]).sum(axis=1) < 0
    turned = np.concatenate([[False], np.logical_xor.accumulate(flips)])[: len(given)]
    return np.where(turned[:, None], -given, given)


def product(left: Array, right: Array) -> Array:
    """Return the rotation `right` followed by `left`, x y z w, all of shape (4,)."""
    x, y, z, w = left.tolist()
    a, b, c, d = right.tolist()
    return np.array(
        [
            w * a + x * d + y * c - z * b,
            w * b + y * d + z * a - x * c,
            w * c + z * d + x * b - y * a,
            w * d - x * a - y * b - z * c,
        ]
    )


def inverse(quaternion: Array) -> Array:
    """Return the rotation back, of a unit quaternion, shape (4,)."""
    return np.asarray(quaternion * [-1.0, -1.0, -1.0, 1.0])


def from_vector(vector: Array) -> Array:
    """Return the quaternion of the rotation vector `vector`, rad, shape (3,)."""
    angle = float(np.linalg.norm(vector))
    # sinc keeps its digits where the angle goes to zero.
    return np.append(0.5 * np.sinc(angle / (2 * np.pi)) * vector, np.cos(angle / 2))


def between(start: Array, end: Array) -> Array:
    """Return the rotation vector, base frame, of at most π rad, that turns `start` into `end`."""
    turn = product(end, inverse(start))
    if turn[3] < 0:
        turn = -turn
    sine = float(np.linalg.norm(turn[:3]))
    angle = 2 * np.arctan2(sine, turn[3])
    return np.asarray(turn[:3] * (angle / sine if sine > 1e-12 else 2.0))


def turned(orientation: Array, angular_velocity: Array, duration_s: float) -> Array:
    """Return `orientation` after turning with `angular_velocity`, rad/s, base frame."""
    result = product(from_vector(angular_velocity * duration_s), orientation)
    return np.asarray(result / np.linalg.norm(result))


def from_matrix(rotation: Array) -> Array:
    """Return the quaternion of a rotation matrix, (3, 3), w not negative (Bar-Itzhack 2000)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation
    symmetric = np.array(
        [
            [xx - yy - zz, yx + xy, zx + xz, zy - yz],
            [yx + xy, yy - xx - zz, zy + yz, xz - zx],
            [zx + xz, zy + yz, zz - xx - yy, yx - xy],
            [zy - yz, xz - zx, yx - xy, xx + yy + zz],
        ]
    )
    found: Array = np.linalg.eigh(symmetric)[1][:, -1]
    return -found if found[3] < 0 else found


def rotation_matrix(quaternion: ArrayLike) -> Array:
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
