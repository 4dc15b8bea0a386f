"""k-means clustering (thesis 2.1.5, algorithm 1) with MacQueen's coarsening and refinement.

Distances are Euclidean; among unit vectors the nearest by distance is the nearest by angle.
Shapes: M points, D axes, k clusters.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hmcs.arrays import Array
from hmcs.errors import UserError

Integers = NDArray[np.intp]


class ClusteringError(UserError):
    """Points that cannot be clustered as asked; says why, and what to do."""


class Clusters(NamedTuple):
    """A partition of points."""

    centers: Array
    """Shape (k, D)."""
    members: Integers
    """The cluster of each point, shape (M,)."""
    distance: float
    """Total distance of points to their centers, v(k) of (2.20)."""
    iterations: int
    """Times that centers were computed."""
    stationary: bool
    """Whether the centers stopped moving before the most iterations."""

    @property
    def sizes(self) -> Integers:
        """Number of members of each cluster, shape (k,)."""
        return np.bincount(self.members, minlength=len(self.centers))


def k_means(
    points: ArrayLike,
    clusters: int,
    rng: np.random.Generator,
    *,
    restarts: int = 1,
    max_iterations: int = 300,
) -> Clusters:
    """Return the best by total distance of several runs of algorithm 1.

    `points`, shape (M, D). Each run starts from random points, no two of them alike. Raises
    ClusteringError when there are fewer than two points, one is not finite, or there are fewer
    distinct points than clusters; ValueError when `clusters` or `restarts` is below one.
    """
    if clusters < 1 or restarts < 1:
        raise ValueError(f"{clusters} clusters, {restarts} restarts: expected one at least")
    data = checked_points(points)
    distinct, first = np.unique(data, axis=0, return_inverse=True)
    if len(distinct) < clusters:
        raise ClusteringError(
            f"{clusters} clusters of {len(distinct)} distinct points ({len(data)} in all): ask for "
            f"at most {len(distinct)} clusters or give more data"
        )
    best: Clusters | None = None
    for _ in range(restarts):
        order = rng.permutation(len(data))
        _, seen = np.unique(first.ravel()[order], return_index=True)
        start = data[order[np.sort(seen)[:clusters]]]
        found = k_means_from(data, start, max_iterations=max_iterations)
        if best is None or found.distance < best.distance:
            best = found
    assert best is not None
    return best


def k_means_from(points: ArrayLike, start: ArrayLike, *, max_iterations: int = 300) -> Clusters:
    """Return the clusters that algorithm 1 comes to from the centers `start`, shape (k, D).

    A cluster that loses its last member takes the point farthest from its own center, the first of
    several, as its center: it is of more use there than empty, and the number of clusters stays
    what was asked for. Raises ClusteringError as `k_means`.
    """
    data = checked_points(points)
    centers = np.array(start, dtype=float)
    members = assign(data, centers)
    for iteration in range(1, max_iterations + 1):
        centers = _means(data, members, centers)
        moved = assign(data, centers)
        if np.array_equal(moved, members):
            return _clusters(data, centers, members, iteration, stationary=True)
        members = moved
    return _clusters(data, centers, members, max_iterations, stationary=False)


def adaptive_k_means(
    points: ArrayLike,
    clusters: int,
    rng: np.random.Generator,
    *,
    coarsening: float,
    refinement: float,
    max_iterations: int = 300,
) -> Clusters:
    """Return clusters whose number adapts to the data (MacQueen 1967; thesis 2.19).

    Starting from `clusters` random points, each iteration of algorithm 1 is followed by coarsening
    and refinement: while two centers are nearer than `coarsening`, the nearest two become their
    mean weighted by numbers of members; while a point is farther from all centers than
    `refinement`, the farthest becomes a center. `refinement` below `coarsening` would make centers
    only to merge them again: ValueError. Raises ClusteringError as `k_means`.
    """
    if not 0 <= coarsening <= refinement:
        raise ValueError(
            f"coarsening {coarsening}, refinement {refinement}: expected 0 <= coarsening <= "
            "refinement"
        )
    data = checked_points(points)
    centers = k_means(data, clusters, rng, max_iterations=1).centers
    members = assign(data, centers)
    for iteration in range(1, max_iterations + 1):
        centers = _means(data, members, centers)
        centers = coarsened(centers, np.bincount(members, minlength=len(centers)), coarsening)
        centers = refined(data, centers, refinement)
        moved = assign(data, centers)
        used, moved = np.unique(moved, return_inverse=True)
        centers = centers[used]
        if np.array_equal(moved, members):
            return _clusters(data, centers, members, iteration, stationary=True)
        members = moved
    return _clusters(data, centers, members, max_iterations, stationary=False)


def assign(points: ArrayLike, centers: ArrayLike) -> Integers:
    """Return the nearest center of each point, shape (M,); of several the lowest."""
    return np.asarray(distances(points, centers).argmin(axis=1))


def distances(points: ArrayLike, centers: ArrayLike) -> Array:
    """Return the distance of each point (M, D) to each center (k, D), shape (M, k)."""
    data, around = np.asarray(points, dtype=float), np.asarray(centers, dtype=float)
    # Axis by axis: differences keep ties exact, and no (M, k, D) array is made.
    squared = np.zeros((len(data), len(around)))
    for axis in range(data.shape[1]):
        squared += (data[:, axis, None] - around[None, :, axis]) ** 2
    return np.asarray(np.sqrt(squared))


def coarsened(centers: Array, weights: ArrayLike, coarsening: float) -> Array:
    """Return centers with the nearest two merged, by their weights (k,), while Δ < C (2.19).

    The merged center stands in the place of the first of the two.
    """
    kept, weight = centers.copy(), np.array(weights, dtype=float)
    while len(kept) > 1:
        apart = distances(kept, kept)
        apart[np.tril_indices(len(kept))] = np.inf
        i, j = np.unravel_index(apart.argmin(), apart.shape)
        if not apart[i, j] < coarsening:
            break
        kept[i] = np.average(kept[[i, j]], axis=0, weights=weight[[i, j]])
        weight[i] += weight[j]
        kept, weight = np.delete(kept, j, axis=0), np.delete(weight, j)
    return kept


def refined(points: Array, centers: Array, refinement: float) -> Array:
    """Return centers with the farthest point added as one while it is farther than R from all."""
    added = [centers]
    nearest = distances(points, centers).min(axis=1)
    while nearest.max() > refinement:
        far = points[nearest.argmax()][None]
        added.append(far)
        nearest = np.minimum(nearest, distances(points, far)[:, 0])
    return np.concatenate(added)


def checked_points(points: ArrayLike) -> Array:
    """Return points as an array of shape (M, D), M > 1, all finite; or raise ClusteringError."""
    data = np.asarray(points, dtype=float)
    if data.ndim != 2 or data.shape[1] == 0:
        raise ClusteringError(f"points have shape {data.shape}: give them as (M, D)")
    if len(data) < 2:
        raise ClusteringError(f"{len(data)} points to cluster: give two at least")
    finite = np.isfinite(data).all(axis=1)
    if not finite.all():
        raise ClusteringError(
            f"point {int((~finite).argmax())} has a value that is not finite: leave it out"
        )
    return data


def _means(points: Array, members: Integers, centers: Array) -> Array:
    """The mean of each cluster's members; see `k_means_from` for a cluster without any."""
    sizes = np.bincount(members, minlength=len(centers))
    empty = np.flatnonzero(sizes == 0)
    if len(empty):
        members = members.copy()
        away = np.linalg.norm(points - centers[members], axis=1)
        for cluster in empty:
            # A point alone in its cluster stays: moving it would leave another one empty.
            movable = np.where(sizes[members] > 1, away, -1.0)
            far = int(movable.argmax())
            sizes[members[far]] -= 1
            members[far], sizes[cluster], away[far] = cluster, 1, -1.0
    sums = np.stack(
        [np.bincount(members, weights=axis, minlength=len(centers)) for axis in points.T], axis=1
    )
    return np.asarray(sums / sizes[:, None])


def _clusters(
    points: Array, centers: Array, members: Integers, iterations: int, *, stationary: bool
) -> Clusters:
    away = np.linalg.norm(points - centers[members], axis=1)
    return Clusters(centers, members, float(away.sum()), iterations, stationary)
