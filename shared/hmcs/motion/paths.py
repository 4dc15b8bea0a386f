"""Paths: curves through points, measured by arc length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hmcs.arrays import Array

_TIE = 1e-9
"""Distances that differ by less than this share of the path's length count as equal."""


class _Pieces(NamedTuple):
    """The straight pieces of a path, those of no length left out."""

    first: Array
    """Where each begins, m, shape (k, 3)."""
    directions: Array
    """Unit length, shape (k, 3)."""
    starts: Array
    ends: Array
    """Arc lengths, m, shape (k,)."""


@dataclass(frozen=True, eq=False)
class Path:
    """A curve of straight pieces through points.

    Raises ValueError unless there are two different points at least, all of them finite.
    """

    points: Array
    """m, shape (K, 3)."""
    arc_length: Array = field(init=False)
    """Length of the path up to each point, m, shape (K,); begins with 0."""
    _pieces: _Pieces = field(init=False, repr=False)

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=float)
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise ValueError(
                f"points have shape {points.shape}, expected (K, 3) with finite numbers only"
            )
        arc_length = arc_length_of(points)
        if not len(points) or not arc_length[-1] > 0:
            raise ValueError("a path needs two different points at least")
        points.flags.writeable = arc_length.flags.writeable = False
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "arc_length", arc_length)
        object.__setattr__(self, "_pieces", _pieces_of(points, arc_length))

    @property
    def length_m(self) -> float:
        """Length of the whole path, m."""
        return float(self.arc_length[-1])

    def at(self, arc_length: ArrayLike) -> Array:
        """Return the point(s) at an arc length, m: shape (3,), or (n, 3) for n arc lengths.

        Before the first and after the last point the path stands still.
        """
        pieces = self._pieces
        s = np.minimum(np.maximum(arc_length, 0.0), pieces.ends[-1])
        piece = pieces.starts.searchsorted(s, side="right") - 1
        beyond = (s - pieces.starts[piece])[..., None]
        return np.asarray(pieces.first[piece] + beyond * pieces.directions[piece])

    def tangent(self, arc_length: float, reach_m: float = 0.0) -> Array:
        """Return the unit direction of travel at an arc length, shape (3,).

        With a reach it is the direction of the chord from so far behind to so far ahead (within
        the path's ends), which changes smoothly along the path.
        """
        s = min(max(float(arc_length), 0.0), self.length_m)
        if reach_m > 0:
            behind, ahead = self.at((s - reach_m, s + reach_m))
            chord = ahead - behind
            length_m = np.sqrt(chord @ chord)
            if length_m > 0:
                return np.asarray(chord / length_m)
        piece = int(self._pieces.starts.searchsorted(s, side="right")) - 1
        return np.asarray(self._pieces.directions[piece])

    def project(
        self, point: ArrayLike, near: float | None = None, window_m: float | None = None
    ) -> float:
        """Return the arc length, m, of the path's closest point to a point of shape (3,).

        With `near`, only arc lengths within `window_m` of it count (the whole path where that is
        None) and of equally close points the one nearest to it is taken: so a path that crosses
        itself is followed, not cut short.
        """
        lower, upper = 0.0, self.length_m
        if near is not None and window_m is not None:
            lower = min(max(near - window_m, 0.0), self.length_m)
            upper = max(min(near + window_m, self.length_m), lower)
        pieces = self._pieces
        inside = slice(
            int(pieces.ends.searchsorted(lower)),
            int(pieces.starts.searchsorted(upper, side="right")),
        )
        starts, directions = pieces.starts[inside], pieces.directions[inside]
        beside = np.asarray(point, dtype=float) - pieces.first[inside]
        along = starts + np.einsum("ij,ij->i", beside, directions)
        s = np.minimum(
            np.maximum(along, np.maximum(starts, lower)), np.minimum(pieces.ends[inside], upper)
        )
        beside -= (s - starts)[:, None] * directions
        distance = np.sqrt(np.einsum("ij,ij->i", beside, beside))
        best = int(distance.argmin())
        if near is None or len(s) == 1:
            return float(s[best])
        ties = (distance <= distance[best] + _TIE * self.length_m).nonzero()[0]
        return float(s[best] if len(ties) == 1 else s[ties[np.abs(s[ties] - near).argmin()]])


def resample(points: ArrayLike, count: int) -> Array:
    """Return `count` points evenly spaced by arc length along points of shape (T, 3).

    Shape (count, 3), from the first point to the last.
    Raises ValueError for fewer than two points asked for, and as `Path` does.
    """
    if count < 2:
        raise ValueError(f"count is {count}, expected two points at least")
    path = Path(np.asarray(points, dtype=float))
    return path.at(np.linspace(0.0, path.length_m, count))


def mean_path(paths: Sequence[ArrayLike], count: int = 100) -> tuple[Array, Array]:
    """Return the mean of several paths and how far they lie beside it.

    Each path, points of shape (T, 3) in m, is taken from its own first point and resampled by arc
    length. Returns the mean's points, shape (count, 3), beginning at 0, and the spread, shape
    (count,): the root mean square distance of the paths' points across the mean's tangent, m.
    Raises ValueError when there is no path, and as `resample` does.
    """
    if not paths:
        raise ValueError("no path to take the mean of")
    arrays = [np.asarray(path, dtype=float) for path in paths]
    sampled = np.stack([resample(array - array[0], count) for array in arrays])
    points = sampled.mean(axis=0)
    mean = Path(points)
    tangents = np.stack([mean.tangent(s) for s in mean.arc_length])
    beside = sampled - points
    along = np.einsum("nkd,kd->nk", beside, tangents)
    across = beside - along[..., None] * tangents
    return points, np.sqrt((across**2).sum(axis=-1).mean(axis=0))


def arc_length_of(points: Array) -> Array:
    """Return the length of the way up to each of the points, m, shapes (T, 3) and (T,)."""
    pieces = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(pieces)]) if len(points) else pieces


def _pieces_of(points: Array, arc_length: Array) -> _Pieces:
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    long = np.diff(arc_length) > 0
    directions = steps[long] / lengths[long, None]
    return _Pieces(points[:-1][long], directions, arc_length[:-1][long], arc_length[1:][long])
