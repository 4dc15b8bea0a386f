"""How the hand turns along a path: learned beside the path, measured from its beginning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hmcs.arrays import Array
from hmcs.motion.paths import arc_length_of
from hmcs.motion.quaternions import continuous, inverse, product, unit_quaternion


@dataclass(frozen=True, eq=False)
class OrientationProfile:
    """Rotations from the orientation a path was begun in, at even shares of its length."""

    quaternions: Array
    """x y z w, base frame, each near the one before, shape (K, 4)."""

    def at(self, progress: float) -> Array:
        """Return the rotation at a share of the path's length, 0 to 1, x y z w, shape (4,)."""
        place = min(max(progress, 0.0), 1.0) * (len(self.quaternions) - 1)
        before = min(int(place), len(self.quaternions) - 2)
        share = place - before
        between = (1.0 - share) * self.quaternions[before] + share * self.quaternions[before + 1]
        return np.asarray(between / np.linalg.norm(between))


def mean_orientation_profile(
    paths: Sequence[ArrayLike], orientations: Sequence[ArrayLike], count: int = 100
) -> Array:
    """Return the mean rotation since the beginning, x y z w, at `count` even shares of length.

    Of several performances: points, m, shape (T, 3), and unit quaternions, shape (T, 4), each.
    Rotations are in the base frame, shape (count, 4); the mean is the normalized sum (Markley et
    al. 2007 for rotations that are near each other). Raises ValueError where none is given or one
    does not move.
    """
    if not paths:
        raise ValueError("no performance to take the mean turn of")
    shares = np.linspace(0.0, 1.0, count)
    total = np.zeros((count, 4))
    for points, turned in zip(paths, orientations, strict=True):
        lengths = arc_length_of(np.asarray(points, dtype=float))
        if not lengths[-1] > 0:
            raise ValueError("a performance does not move: its turns have no places")
        given = continuous(turned)
        back = inverse(unit_quaternion(given[0]))
        since = continuous([product(each, back) for each in given])
        total += np.stack(
            [np.interp(shares, lengths / lengths[-1], column) for column in since.T], axis=1
        )
    return np.asarray(total / np.linalg.norm(total, axis=1, keepdims=True))
