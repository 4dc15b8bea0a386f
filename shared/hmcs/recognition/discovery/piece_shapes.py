"""Which pieces of motion have the same shape, wherever they are performed."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.paths import resample

Integers = NDArray[np.int64]

_POINTS = 24
"""Whole pieces are compared at so many points."""
_LENGTH = 0.15
"""A difference in length counts as much as this share of it beside the path."""


def spread_about(mean: Array, performed: Sequence[Array]) -> float:
    """Return the root mean square distance of performances of a piece from their mean, m."""
    middle = _centered(resample(mean, _POINTS))
    squares = [_squares(_centered(resample(own, _POINTS)) - middle) for own in performed]
    return float(np.sqrt(np.mean(np.array(squares))))


def shape_distance(first: Array, second: Array) -> float:
    """Return how far two pieces in equal steps, shapes (m, 3) and (n, 3), differ in shape, m.

    It is a root mean square distance about their middles, which are surer than their starts, where
    the hand still comes from the piece before. Compared are the whole pieces and, in case a
    boundary stands too early or too late, the shorter with every stretch of the longer, where the
    rest counts as a difference in length; the nearest counts.
    """
    apart = _centered(resample(first, _POINTS)) - _centered(resample(second, _POINTS))
    short, long = sorted([first, second], key=len)
    windows = np.moveaxis(sliding_window_view(long, len(short), axis=0), -1, 1)
    part = float(_squares(_centered(windows) - _centered(short)).min())
    rest = _LENGTH * abs(_length(long) - _length(short))
    return float(np.sqrt(min(float(_squares(apart)), part + rest**2)))


def grouped(pieces: Sequence[Array], closest_m: float) -> Integers:
    """Return the group of each piece, shape (n,), numbered in the order of first occurrence.

    Average linkage: the two groups whose shapes are nearest to one another on average become one,
    until no two are within `closest_m`.
    """
    count = len(pieces)
    apart = np.full((count, count), np.inf)
    for a, b in combinations(range(count), 2):
        apart[a, b] = apart[b, a] = shape_distance(pieces[a], pieces[b])
    group, size = np.arange(count), np.ones(count)
    while True:
        first, second = (int(k) for k in np.unravel_index(apart.argmin(), apart.shape))
        if not apart[first, second] <= closest_m:
            break
        mean = (size[first] * apart[first] + size[second] * apart[second]) / (
            size[first] + size[second]
        )
        mean[first] = np.inf
        apart[first], apart[:, first] = mean, mean
        apart[second], apart[:, second] = np.inf, np.inf
        size[first] += size[second]
        group[group == second] = first
    _, begins, number = np.unique(group, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(begins))[number]


def _centered(points: Array) -> Array:
    return np.asarray(points - points.mean(axis=-2, keepdims=True))


def _squares(apart: Array) -> Array:
    """Mean square distance, one for each path."""
    return np.asarray((apart**2).sum(axis=-1).mean(axis=-1))


def _length(piece: Array) -> float:
    return float(np.linalg.norm(np.diff(piece, axis=0), axis=1).sum())
