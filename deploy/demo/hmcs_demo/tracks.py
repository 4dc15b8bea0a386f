"""Paths as they were gone, by the hand and by the robot's tool, and how far off they were."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.paths import Path
from hmcs_demo.truth import TrueStateInterval

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

PATH_SPACING_M = 5e-4
"""Distance between the points of a path that are matched."""


class Track(NamedTuple):
    """A path as it was gone, n points in the order of time."""

    sample: IntArray
    """Number of the played sample each point goes back to."""
    position: Array
    """m, shape (n, 3)."""
    error_m: Array
    """Distance to the mean demonstration of the true segment; NaN outside of any."""


def track(
    sample: IntArray,
    position: Array,
    segments: Sequence[TrueStateInterval],
    learned: Sequence[Path | None],
    hand: Array,
    stood: BoolArray | None = None,
) -> Track:
    """Return a track with its distances to the mean demonstrations.

    `learned` is the path of each state, None where it has not exactly one. For each true segment
    it is laid where the track itself is when the segment truly begins. `hand` is the hand at each
    played sample, m, shape (N, 3); `stood`, shape (n,), is true for a point before which the robot
    stood: what the hand moved meanwhile is no error of the robot's, and counts as gone with it.
    """
    error_m = np.full(len(sample), np.nan)
    gone = position if stood is None else position + _missed(sample, position, hand, stood)
    for segment in segments:
        path = learned[segment.state] if segment.state >= 0 else None
        rows = np.flatnonzero((sample >= segment.begin) & (sample <= segment.end))
        if path is not None and len(rows):
            origin = gone[rows[0]] - (hand[sample[rows[0]]] - hand[segment.begin])
            error_m[rows] = path_errors(path, gone[rows] - origin)
    return Track(sample, position, error_m)


def _missed(sample: IntArray, position: Array, hand: Array, stood: BoolArray) -> Array:
    """How far the hand has moved so far without the robot, m, shape (n, 3)."""
    missed = np.zeros_like(position)
    after = np.flatnonzero(stood)
    before = after - 1
    missed[after] = hand[sample[after]] - hand[sample[before]] - position[after] + position[before]
    return missed.cumsum(axis=0)


def path_errors(path: Path, displacements: Array) -> Array:
    """Return how far each displacement from the path's origin, m, shape (n, 3), is from it, (n,).

    Each is matched with a point of the path such that none is matched with one behind that of the
    displacement before it, and the sum of squared distances is the least there is. So what crosses
    itself, or turns back close beside itself, is neither cut short nor gone backwards.
    """
    count = int(np.ceil(path.length_m / PATH_SPACING_M)) + 1
    points = path.at(np.linspace(0.0, path.length_m, count))
    squared = ((displacements[:, None] - points) ** 2).sum(axis=2)
    # Least sum up to each displacement, where it is matched with each point.
    total = squared[0].copy()
    reached_from = np.empty(squared.shape, dtype=np.int64)
    for k in range(1, len(squared)):
        least = np.minimum.accumulate(total)
        reached_from[k] = np.maximum.accumulate(np.where(total == least, np.arange(count), 0))
        total = least + squared[k]
    matched = np.empty(len(squared), dtype=np.int64)
    matched[-1] = int(total.argmin())
    for k in range(len(squared) - 1, 0, -1):
        matched[k - 1] = reached_from[k, matched[k]]
    return np.asarray(np.sqrt(squared[np.arange(len(squared)), matched]))


def recognized(sample: IntArray, finished: IntArray, believed: IntArray) -> IntArray:
    """Return the state that was the most probable when each point was gone, shape (n,).

    `finished` are the numbers of the samples that completed the steps, `believed` the states after
    them: what a step was recognized as colors the motion that made it.
    """
    step = np.searchsorted(finished, sample, side="left")
    return np.asarray(believed[np.minimum(step, len(believed) - 1)])
