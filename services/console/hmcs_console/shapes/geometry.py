"""Shapes as a page draws them: edges, and surfaces of triangles, m."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Points = NDArray[np.float64]


class Surface(NamedTuple):
    """Triangles."""

    vertices: Points
    """m, shape (V, 3)."""
    faces: NDArray[np.int64]
    """Three vertices each, shape (F, 3)."""


def box_edges(lower: ArrayLike, upper: ArrayLike) -> Points:
    """Return the twelve edges of a box between two corners, shape (12, 2, 3)."""
    ends = np.array([lower, upper], dtype=float)
    corners = list(product((0, 1), repeat=3))
    edges = [
        (one, other)
        for index, one in enumerate(corners)
        for other in corners[index:]
        if sum(a != b for a, b in zip(one, other, strict=True)) == 1
    ]
    axes = np.arange(3)
    return np.array([[ends[list(corner), axes] for corner in edge] for edge in edges])


def line(points: Points) -> Points:
    """Return the pieces of a line through points of shape (n, 3), shape (n − 1, 2, 3)."""
    return np.stack([points[:-1], points[1:]], axis=1)


def tube(points: ArrayLike, radii: ArrayLike, sides: int = 16) -> Surface:
    """Return the surface about a line through points, shape (n, 3), with a radius at each, (n,)."""
    centers, widths = np.asarray(points, dtype=float), np.asarray(radii, dtype=float)
    tangents = np.gradient(centers, axis=0)
    angles = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    across = _carried_across(tangents)
    rings = centers[:, None] + widths[:, None, None] * np.einsum("sk,nkd->nsd", circle, across)
    index = np.arange(len(centers) * sides).reshape(len(centers), sides)
    near, far = index[:-1], index[1:]
    near_next, far_next = np.roll(near, -1, axis=1), np.roll(far, -1, axis=1)
    faces = np.concatenate(
        [
            np.stack([near, near_next, far], axis=-1).reshape(-1, 3),
            np.stack([near_next, far_next, far], axis=-1).reshape(-1, 3),
        ]
    )
    return Surface(rings.reshape(-1, 3), faces)


def capsule(begin: ArrayLike, end: ArrayLike, radius_m: float, rings: int = 8) -> Surface:
    """Return the surface at a distance from the line between two points, which may be one."""
    first, last = np.asarray(begin, dtype=float), np.asarray(end, dtype=float)
    length = float(np.linalg.norm(last - first))
    axis = (last - first) / length if length > 0 else np.array([0.0, 0.0, 1.0])
    angles = np.linspace(0.0, np.pi / 2, rings)
    along = np.concatenate([-np.cos(angles), np.sin(angles)]) * radius_m
    around = np.concatenate([np.sin(angles), np.cos(angles)]) * radius_m
    origins = np.repeat([first, last], rings, axis=0)
    # The two rings about the middle of a ball would be one.
    kept = slice(None) if length > 0 else np.arange(2 * rings) != rings
    return tube((origins + along[:, None] * axis)[kept], around[kept])


def turn_to(direction: ArrayLike) -> NDArray[np.float64]:
    """Return the rotation that brings the z axis into a direction, w x y z, shape (4,)."""
    x, y, z = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    if z < -1 + 1e-9:
        return np.array([0.0, 1.0, 0.0, 0.0])
    quaternion = np.array([1 + z, -y, x, 0.0])
    return np.asarray(quaternion / np.linalg.norm(quaternion))


def wxyz(xyzw: ArrayLike) -> NDArray[np.float64]:
    """Return a quaternion x y z w as w x y z, shape (4,)."""
    return np.roll(np.asarray(xyzw, dtype=float), 1)


def _carried_across(tangents: Points) -> Points:
    """Two unit vectors across each tangent, shape (n, 2, 3), turning as little as can be."""
    across = np.empty((len(tangents), 2, 3))
    # Begins with the axis the first tangent has the least of.
    carried = np.eye(3)[np.abs(tangents[0]).argmin()]
    for index, tangent in enumerate(tangents):
        length = np.linalg.norm(tangent)
        unit = tangent / length if length > 0 else np.array([0.0, 0.0, 1.0])
        first = carried - (carried @ unit) * unit
        size = np.linalg.norm(first)
        if size < 1e-9:
            first = np.eye(3)[np.abs(unit).argmin()]
            first = first - (first @ unit) * unit
            size = np.linalg.norm(first)
        carried = first / size
        across[index] = carried, np.cross(unit, carried)
    return across
