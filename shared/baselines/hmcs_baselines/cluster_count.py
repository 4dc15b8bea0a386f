"""The number of clusters by the elbow criterion (thesis 2.1.5, 2.20–2.22, figs 2.5–2.8).

Every function returns what its figure shows, besides the number.
Shapes: K is the most clusters searched; entry i of an array over k belongs to k = i + 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hmcs.arrays import Array
from hmcs_baselines.clustering import ClusteringError, Clusters, k_means


class ClusterSearch(NamedTuple):
    """Clusters for every number k = 1..K; figs 2.5 and, above, 2.6–2.8."""

    clusters: tuple[Clusters, ...]
    """For each k."""
    distance: Array
    """v(k), total distance to the centers (2.20), shape (K,)."""
    error: Array
    """e(k) = (v − min v) / (max v − min v), shape (K,)."""

    @property
    def slope(self) -> Array:
        """Δe(k) = e(k) − e(k−1) for k = 2..K, shape (K − 1,)."""
        return np.diff(self.error)


class CusumSettings(NamedTuple):
    """Of the backward test."""

    drift: float = 0.01
    """ν: a rise of −Δe above its mean that counts as none."""
    threshold: float = 0.05
    """h: alarm above it."""


class Elbow(NamedTuple):
    """What the backward CUSUM-RLS test made of a curve; below in figs 2.6–2.8."""

    clusters: int
    """The elbow: the k of the last reset before the alarm."""
    alarm: int | None
    """The k at which g(k) > h; None when the curve falls evenly, and `clusters` is then the last
    reset."""
    statistic: Array
    """g(k), shape (K,); from k = K down to the alarm, NaN below it."""
    expected: Array
    """ŷ: what −Δe(k + 1) was expected to be when g(k) was computed, shape (K,); NaN at k = K and
    below the alarm."""
    resets: tuple[int, ...]
    """Every k at which the test was reset, from K downward."""


def search_clusters(
    points: ArrayLike, most: int, rng: np.random.Generator, *, restarts: int = 20
) -> ClusterSearch:
    """Return the clusters of points (M, D) for k = 1..`most`, each the best of several starts.

    Many starts are needed: a few bad clusterings make a curve with elbows of their own. Raises
    ClusteringError as `k_means`, and when `most` is below two.
    """
    if most < 2:
        raise ClusteringError(f"most is {most}: an elbow needs two numbers of clusters at least")
    # The largest number first: where it is too large for the data, no time is lost on the others.
    found = [k_means(points, k, rng, restarts=restarts) for k in range(most, 0, -1)][::-1]
    distance = np.array([clusters.distance for clusters in found])
    return ClusterSearch(tuple(found), distance, normalized_error(distance))


def normalized_error(distance: ArrayLike) -> Array:
    """Return e(k), from 1 down to 0, of v(k), shape (K,); zeros where v is all the same."""
    v = np.asarray(distance, dtype=float)
    span = np.ptp(v)
    return (v - v.min()) / span if span > 0 else np.zeros_like(v)


def cusum_elbow(
    error: ArrayLike,
    settings: CusumSettings = CusumSettings(),  # noqa: B008  frozen
) -> Elbow:
    """Return the elbow of e(k), shape (K,), by the CUSUM-RLS test run backward (2.21–2.22).

    From g(K) = 0 on, g(n − 1) = g(n) + y(n) − ŷ − ν with y = −Δe, so that g rises where the curve
    begins to fall faster than it did further out. ŷ is the mean of y since the last reset; it
    starts anew from the sample that brought the reset, and from y(K) in the beginning. Where
    g(n) < 0 it is set to zero and the test is reset; where g(n) > h is the alarm.
    """
    e = np.asarray(error, dtype=float)
    most = len(e)
    statistic, expected = np.full(most, np.nan), np.full(most, np.nan)
    if most < 2:
        raise ValueError(f"error has shape {e.shape}, expected two values at least")
    y = np.concatenate([[np.nan], -np.diff(e)])
    statistic[-1] = g = 0.0
    resets = [most]
    mean, seen = y[-1], 1
    for n in range(most, 1, -1):
        g += y[n - 1] - mean - settings.drift
        expected[n - 2] = mean
        if g < 0:
            g, mean, seen = 0.0, y[n - 1], 1
            resets.append(n - 1)
        else:
            seen += 1
            mean += (y[n - 1] - mean) / seen
        statistic[n - 2] = g
        if g > settings.threshold:
            return Elbow(resets[-1], n - 1, statistic, expected, tuple(resets))
    return Elbow(resets[-1], None, statistic, expected, tuple(resets))


def error_elbow(error: ArrayLike, threshold: float) -> int:
    """Return the first k whose e(k) is below a threshold; K if none is."""
    e = np.asarray(error, dtype=float)
    below = np.flatnonzero(e < threshold)
    return int(below[0]) + 1 if len(below) else len(e)


def slope_elbow(error: ArrayLike, threshold: float) -> int:
    """Return the first k after which −Δe(k + 1) is below a threshold; K if it never is.

    A cluster more than that would not be worth its while.
    """
    e = np.asarray(error, dtype=float)
    below = np.flatnonzero(-np.diff(e) < threshold)
    return int(below[0]) + 1 if len(below) else len(e)
