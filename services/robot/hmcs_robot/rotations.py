"""Rotations as unit quaternions x y z w and as rotation vectors (axis times angle, rad)."""

from __future__ import annotations

import numpy as np

from hmcs_robot.driver import Array


def product(left: Array, right: Array) -> Array:
    """Return the rotation `right` followed by `left`, shape (4,)."""
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


def from_vector(vector: Array) -> Array:
    """Return the quaternion of the rotation vector `vector`, rad, shape (3,)."""
    angle = float(np.linalg.norm(vector))
    # sinc keeps its digits where the angle goes to zero.
    return np.append(0.5 * np.sinc(angle / (2 * np.pi)) * vector, np.cos(angle / 2))


def between(start: Array, end: Array) -> Array:
    """Return the rotation vector, base frame, of at most π rad, that turns `start` into `end`."""
    turn = product(end, start * [-1.0, -1.0, -1.0, 1.0])
    if turn[3] < 0:
        turn = -turn
    sine = float(np.linalg.norm(turn[:3]))
    angle = 2 * np.arctan2(sine, turn[3])
    vector: Array = turn[:3] * (angle / sine if sine > 1e-12 else 2.0)
    return vector


def turned(orientation: Array, angular_velocity: Array, duration_s: float) -> Array:
    """Return `orientation` after turning with `angular_velocity`, rad/s, base frame."""
    result = product(from_vector(angular_velocity * duration_s), orientation)
    unit: Array = result / np.linalg.norm(result)
    return unit
