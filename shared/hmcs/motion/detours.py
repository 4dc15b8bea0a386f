"""Ways around an obstacle: what an operator means to do who sees something on the path."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hmcs.motion.paths import Path

FloatArray = NDArray[np.float64]

_SPACING_M = 0.002
_GOOD_ENOUGH_M = 1e-4
_MOST_ROUNDS = 60


class Detour(NamedTuple):
    """A path that leaves another one for a while."""

    path: Path
    leaves_at_m: float
    """Arc length, of both paths, up to which they are the same."""
    returns_at_m: float
    """Arc length of the other path from which on they are the same again."""


def around(
    path: Path, center: ArrayLike, radius_m: float, *, clearance_m: float, run_up_m: float
) -> Detour:
    """Return the path bent around a sphere: center, m, shape (3,), and radius.

    The bend is a raised cosine that begins `run_up_m` before the sphere and ends as far behind it,
    on the side the path passes the center on (for a path through the center, on one across it), and
    just high enough to keep `clearance_m`.
    Raises ValueError where the path comes no nearer than that anyway, or where the sphere stands on
    one of its ends.
    """
    middle = np.asarray(center, dtype=float)
    keep_m = radius_m + clearance_m
    count = max(2, int(path.length_m / _SPACING_M) + 1)
    places = np.linspace(0.0, path.length_m, count)
    points = path.at(places)
    distances = np.linalg.norm(points - middle, axis=1)
    nearest = int(distances.argmin())
    if distances[nearest] >= keep_m:
        raise ValueError(
            f"the path passes the sphere at {distances[nearest]:.3f} m from its center, expected "
            f"less than radius and clearance together ({keep_m:.3f} m): there is nothing to avoid"
        )
    if min(distances[0], distances[-1]) <= keep_m:
        raise ValueError(
            "the sphere stands on an end of the path: move it, or make it smaller, so that there "
            "is a way around"
        )
    half_m = keep_m + run_up_m
    bump = np.zeros(count)
    inside = np.abs(places - places[nearest]) < half_m
    bump[inside] = 0.5 * (1.0 + np.cos(np.pi * (places[inside] - places[nearest]) / half_m))
    side = _side(path, places[nearest], points[nearest] - middle)
    height_m = 0.0
    for _ in range(_MOST_ROUNDS):
        bent = points + height_m * bump[:, None] * side
        short_m = keep_m - float(np.linalg.norm(bent[inside] - middle, axis=1).min())
        if short_m <= _GOOD_ENOUGH_M:
            break
        height_m += max(short_m, _GOOD_ENOUGH_M)
    affected = np.flatnonzero(bump)
    return Detour(Path(bent), float(places[affected[0]]), float(places[affected[-1]]))


def _side(path: Path, at_m: float, away: FloatArray) -> FloatArray:
    """Unit vector across the path, away from the center of the obstacle."""
    tangent = path.tangent(at_m)
    away = away - (away @ tangent) * tangent
    length_m = float(np.linalg.norm(away))
    if length_m > 1e-6:
        return np.asarray(away / length_m)
    other = np.eye(3)[int(np.abs(tangent).argmin())]
    across = other - (other @ tangent) * tangent
    return np.asarray(across / np.linalg.norm(across))
