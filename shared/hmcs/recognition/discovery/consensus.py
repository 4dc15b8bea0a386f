"""What several performances of the same motion have in common: their mean after alignment.

Performances in equal steps are aligned by dynamic time warping on place and direction, first with
one another, coarsely, to see which belong together and which of them is in their middle, then each
with the mean of all, again and again (barycenter averaging, Petitjean et al. 2011).
Shapes: T_d steps of performance d, N points of the mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.discovery.curve_pieces import axes_filled

Integers = NDArray[np.int64]

_ITERATIONS = 4
_COARSE_STEPS = 3
"""Performances are compared with one another at every so many steps."""
_COMPARED = 6
"""Performances have different motions where so many pairs of coarse steps on end disagree."""
_LONGER = 2.0
"""No performance is longer than so many times another one of the same motions."""
_PLACE_STEPS = 3.0
"""Until it is known better: performances lie so many steps beside one another..."""
_DIRECTION = 0.5
"""...and their unit directions differ by so much."""
_REACH_STEPS = 2
"""A direction is that of the chord from so many steps behind to so many ahead."""
_WINDOW_STEPS = 20
"""What performances differ by over longer stretches is drift, not noise."""


class Consensus(NamedTuple):
    """The mean of performances that were aligned."""

    path: Array
    """m, in equal steps, shape (N, 3)."""
    at: tuple[Array, ...]
    """For each performance and each point of the path, where in the performance it is passed:
    step counted from 0, with fractions, rising, shape (N,)."""
    variance: float
    """Of one performance about the mean, along one axis across the path, m²; drift left out. 0 for
    a single performance: nothing tells."""
    correlation: float
    """Of that deviation from one step to the next; 0 for a single performance."""


def equal_steps(positions: Array, step_m: float) -> tuple[Array, Array]:
    """Return a path in equal steps of about `step_m`, from its first point to its last.

    Returns points, shape (T, 3), and where between the positions, shape (S, 3), each lies: index
    with fractions, shape (T,).
    """
    lengths = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(lengths)])
    count = max(round(travelled[-1] / step_m), 1)
    # Where the hand stands still it is at the last of the positions it has there.
    moving = np.concatenate([lengths > 0, [True]])
    index = np.interp(
        np.linspace(0.0, travelled[-1], count + 1), travelled[moving], np.flatnonzero(moving)
    )
    index[0] = 0.0
    return between(positions, index), index


def alike(performances: Sequence[Array], step_m: float, least_cosine: float) -> list[Integers]:
    """Group performances of the same order of motions; indices, the one in the middle first.

    Two belong together when their directions, after alignment, nowhere agree by less than
    `least_cosine` over several steps on end: where one has a motion that the other has not, they
    do. Nor may one be more than twice as long as the other. A group is all that belong with one,
    the one with most of them first.
    """
    count = len(performances)
    coarse = [p[::_COARSE_STEPS] if len(p) > 4 * _COARSE_STEPS else p for p in performances]
    apart, agreement = np.zeros((count, count)), np.eye(count)
    for a in range(count):
        for b in range(a):
            aligned = _warp(_distances(coarse[a], coarse[b], _PLACE_STEPS * step_m, _DIRECTION))
            own, other = _directions(coarse[a]), _directions(coarse[b])
            cosine = (own[aligned.first] * other[aligned.second]).sum(axis=1)
            apart[a, b] = apart[b, a] = aligned.cost
            lengths = sorted([len(performances[a]) - 1, len(performances[b]) - 1])
            if lengths[1] <= _LONGER * lengths[0]:
                agreement[a, b] = agreement[b, a] = _least_running_mean(cosine)
    groups, left = [], np.arange(count)
    while len(left):
        together = agreement[np.ix_(left, left)] >= least_cosine
        most = left[together[together.sum(axis=1).argmax()]]
        middle = apart[np.ix_(most, most)].sum(axis=1).argsort(kind="stable")
        groups.append(most[middle])
        left = np.setdiff1d(left, most)
    return groups


def consensus(performances: Sequence[Array], step_m: float) -> Consensus:
    """Return the mean of performances in equal steps, shapes (T_d, 3), the first in their middle.

    Each is taken from its own first point.
    """
    moved = [performance - performance[0] for performance in performances]
    path = moved[0]
    if len(moved) == 1:
        return Consensus(path, (np.arange(len(path), dtype=np.float64),), 0.0, 0.0)
    place, direction = _PLACE_STEPS * step_m, _DIRECTION
    for _ in range(_ITERATIONS):
        aligned = np.stack([between(own, _passed(own, path, place, direction)) for own in moved])
        mean = aligned.mean(axis=0)
        beside = np.sqrt(((aligned - mean) ** 2).sum(axis=-1).mean())
        turned = _directions(mean)
        across = np.mean([((_directions(own) - turned) ** 2).sum(axis=1).mean() for own in aligned])
        place, direction = max(beside, 0.1 * step_m), max(float(np.sqrt(across)), 0.1)
        path = equal_steps(mean, step_m)[0]
    at = tuple(_passed(own, path, place, direction) for own in moved)
    aligned = np.stack([between(own, index) for own, index in zip(moved, at, strict=True)])
    return Consensus(path, at, *_noise(aligned, path))


class _Warp(NamedTuple):
    cost: float
    first: Integers
    """Steps of the one performance..."""
    second: Integers
    """...and those of the other they are aligned with, shape (A,)."""


def _warp(distances: Array) -> _Warp:
    """Dynamic time warping, by antidiagonals: all cells of one depend on the two before it only."""
    rows, columns = distances.shape
    total = np.full((rows + 1, columns + 1), np.inf)
    total[0, 0] = 0.0
    for diagonal in range(2, rows + columns + 1):
        i = np.arange(max(1, diagonal - columns), min(rows, diagonal - 1) + 1)
        j = diagonal - i
        before = np.minimum(total[i - 1, j - 1], np.minimum(total[i - 1, j], total[i, j - 1]))
        total[i, j] = distances[i - 1, j - 1] + before
    i, j = rows, columns
    pairs = []
    while i > 0 and j > 0:
        pairs.append((i - 1, j - 1))
        back = int(np.argmin([total[i - 1, j - 1], total[i - 1, j], total[i, j - 1]]))
        i, j = i - (back != 2), j - (back != 1)
    first, second = np.array(pairs[::-1]).T
    return _Warp(float(total[rows, columns]) / (rows + columns), first, second)


def _least_running_mean(values: Array) -> float:
    width = min(_COMPARED, len(values))
    return float(np.convolve(values, np.full(width, 1.0 / width), "valid").min())


def _distances(first: Array, second: Array, place: float, direction: float) -> Array:
    apart = ((first[:, None] - second[None]) ** 2).sum(axis=-1)
    turned = 2.0 - 2.0 * _directions(first) @ _directions(second).T
    return np.asarray(apart / place**2 + turned / direction**2)


def _passed(performance: Array, path: Array, place: float, direction: float) -> Array:
    """Where the performance passes each point of the path; see `Consensus.at`."""
    warp = _warp(_distances(performance, path, place, direction))
    count = np.bincount(warp.second, minlength=len(path))
    mean = np.bincount(warp.second, weights=warp.first, minlength=len(path)) / count
    # Warping stalls and leaps where steps are noisy: the hand does not.
    near = np.clip(np.arange(len(path))[:, None] + np.arange(-2, 3), 0, len(path) - 1)
    smooth = mean[near].mean(axis=1)
    smooth[0], smooth[-1] = 0.0, len(performance) - 1
    return np.maximum.accumulate(smooth)


def _directions(path: Array) -> Array:
    here = np.arange(len(path))
    ahead, behind = here + _REACH_STEPS, here - _REACH_STEPS
    chord = path[np.minimum(ahead, len(path) - 1)] - path[np.maximum(behind, 0)]
    length = np.linalg.norm(chord, axis=1, keepdims=True)
    return np.asarray(chord / np.where(length > 0, length, 1.0))


def _noise(aligned: Array, path: Array) -> tuple[float, float]:
    """Variance and correlation of performances, shape (n, N, 3), across the path."""
    count, points, _ = aligned.shape
    turned = _directions(path)
    beside = aligned - aligned.mean(axis=0)
    beside = beside - (beside * turned).sum(axis=-1, keepdims=True) * turned
    squares = products = 0.0
    for begin in range(0, max(points - _WINDOW_STEPS // 2, 1), _WINDOW_STEPS):
        own = beside[:, begin : begin + _WINDOW_STEPS]
        own = own - own.mean(axis=1, keepdims=True)
        squares += float((own**2).sum()) * (own.shape[1] - 1) / own.shape[1]
        products += float((own[:, 1:] * own[:, :-1]).sum())
    if not squares > 0:
        return 0.0, 0.0
    across = axes_filled(path) - 1
    variance = squares / (points * (count - 1) * across)
    return variance, min(max(products / squares, 0.0), 0.9)


def between(points: Array, index: Array) -> Array:
    """Return what lies between points, shape (T, 3), at indices with fractions, shape (N,)."""
    here = np.arange(len(points))
    return np.stack([np.interp(index, here, column) for column in points.T], axis=1)
