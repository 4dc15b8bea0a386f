"""Ways around an obstacle: what an operator means to do who sees something on the path."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hmcs.arrays import Array
from hmcs.motion.paths import Path

_SPACING_M = 0.002
_GOOD_ENOUGH_M = 1e-4
_SHORT_M = 2 * _GOOD_ENOUGH_M
"""A way that lacks no more of its clearance than this keeps it."""
_MOST_ROUNDS = 60
_MOST_BENDS = 8
"""A path that comes by the sphere more often gets no way around."""
_WIDTHS = (1.0, 1.5, 2.0, 3.0)
_TURNS_RAD = tuple(np.pi * k for k in (0.0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1.0))
"""To these sides a bend may go, from the one the path passes the center on."""


class Detour(NamedTuple):
    """A path that leaves another one for a while."""

    path: Path
    leaves_at_m: float
    """Arc length, of both paths, up to which they are the same."""
    returns_at_m: float
    """Arc length of the other path from which on they are the same again."""


class _Obstacle(NamedTuple):
    middle: Array
    keep_m: float
    """So far from its middle a way has to stay."""


def around(
    path: Path, center: ArrayLike, radius_m: float, *, clearance_m: float, run_up_m: float
) -> Detour:
    """Return the path bent around a sphere: center, m, shape (3,), and radius.

    A bend is a raised cosine that begins `run_up_m` before the sphere and ends as far behind it (or
    at the ends of the path, which stay), on the side the path passes the center on (for a path
    through the center, on one across it), and just high enough to keep `clearance_m`. A path that
    comes by several times has several. Where that is not clear of the sphere, wider bends and other
    sides are tried; the whole way keeps the clearance to 0.2 mm.
    Raises ValueError where the path comes no nearer than that anyway, where the sphere stands on
    one of its ends, and where no way was found.
    """
    obstacle = _Obstacle(np.asarray(center, dtype=float), radius_m + clearance_m)
    _check(obstacle, run_up_m)
    count = max(2, int(path.length_m / _SPACING_M) + 1)
    places = np.linspace(0.0, path.length_m, count)
    points = path.at(places)
    distances = np.linalg.norm(points - obstacle.middle, axis=1)
    nearest_m = _nearest_m(points, obstacle)
    if nearest_m >= obstacle.keep_m - _GOOD_ENOUGH_M:
        raise ValueError(
            f"the path passes the sphere at {nearest_m:.3f} m from its center, expected less than "
            f"radius and clearance together ({obstacle.keep_m:.3f} m): there is nothing to avoid"
        )
    if min(distances[0], distances[-1]) <= obstacle.keep_m:
        raise ValueError(
            "the sphere stands on an end of the path: move it, or make it smaller, so that there "
            "is a way around"
        )
    for width, turn_rad in product(_WIDTHS, _TURNS_RAD):
        half_m = width * (obstacle.keep_m + run_up_m)
        bent = _bent(places, points, obstacle, half_m, turn_rad)
        if bent is not None:
            affected = np.flatnonzero((bent != points).any(axis=1))
            first, last = max(affected[0] - 1, 0), min(affected[-1] + 1, count - 1)
            return Detour(Path(bent), float(places[first]), float(places[last]))
    raise ValueError(
        f"no way around the sphere keeps {clearance_m:.3f} m from it, of all that were tried: the "
        "path winds about it; move it, make it smaller, or give the path a longer run-up"
    )


def _bent(
    places: Array, points: Array, obstacle: _Obstacle, half_m: float, turn_rad: float
) -> Array | None:
    """Return the points bent wherever they come too near; None where that does not help."""
    for _ in range(_MOST_BENDS):
        points = _bent_once(places, points, obstacle, half_m, turn_rad)
        if _nearest_m(points, obstacle) >= obstacle.keep_m - _SHORT_M:
            return points
    return None


def _bent_once(
    places: Array, points: Array, obstacle: _Obstacle, half_m: float, turn_rad: float
) -> Array:
    """Return the points with a bend where they come nearest, clear of the sphere if it can be."""
    nearest = int(np.linalg.norm(points - obstacle.middle, axis=1).argmin())
    bump = _bump(places, places[nearest], half_m)
    affected = np.flatnonzero(bump)
    inside = slice(max(affected[0] - 1, 0), affected[-1] + 2)
    side = _side(points, nearest, obstacle.middle, turn_rad)
    height_m = 0.0
    for _ in range(_MOST_ROUNDS):
        bent = points + height_m * bump[:, None] * side
        short_m = obstacle.keep_m - _nearest_m(bent[inside], obstacle)
        if short_m <= _GOOD_ENOUGH_M:
            break
        height_m += max(short_m, _GOOD_ENOUGH_M)
    return bent


def _bump(places: Array, top_m: float, half_m: float) -> Array:
    """A raised cosine about a place, that leaves the ends of the path where they are."""
    reach_m = np.where(
        places < top_m, min(half_m, top_m - places[0]), min(half_m, places[-1] - top_m)
    )
    share = np.abs(places - top_m) / np.maximum(reach_m, 1e-12)
    return np.where(share < 1.0, 0.5 * (1.0 + np.cos(np.pi * share)), 0.0)


def _side(points: Array, at: int, middle: Array, turn_rad: float) -> Array:
    """Unit vector across the path, away from the middle of the obstacle, turned about the path."""
    tangent = points[min(at + 1, len(points) - 1)] - points[max(at - 1, 0)]
    length_m = float(np.linalg.norm(tangent))
    tangent = tangent / length_m if length_m > 0 else np.eye(3)[0]
    away = points[at] - middle
    away = away - (away @ tangent) * tangent
    length_m = float(np.linalg.norm(away))
    if length_m <= 1e-6:
        other = np.eye(3)[int(np.abs(tangent).argmin())]
        away = other - (other @ tangent) * tangent
        length_m = float(np.linalg.norm(away))
    away = away / length_m
    return np.asarray(np.cos(turn_rad) * away + np.sin(turn_rad) * np.cross(tangent, away))


def _nearest_m(points: Array, obstacle: _Obstacle) -> float:
    """How near the straight pieces between points come to the middle of the obstacle."""
    path = Path(points)
    return float(np.linalg.norm(path.at(path.project(obstacle.middle)) - obstacle.middle))


def _check(obstacle: _Obstacle, run_up_m: float) -> None:
    numbers = (*obstacle.middle.ravel(), obstacle.keep_m, run_up_m)
    if obstacle.middle.shape != (3,) or not np.isfinite(numbers).all():
        raise ValueError(f"sphere at {obstacle.middle}: expected three finite numbers of m")
    if not obstacle.keep_m > 0 or run_up_m < 0:
        raise ValueError(
            f"radius and clearance are {obstacle.keep_m} m, run_up_m is {run_up_m}: expected a "
            "size above zero, and no run-up below it"
        )
