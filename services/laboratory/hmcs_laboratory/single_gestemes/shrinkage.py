"""Linear discriminants from few examples: Gaussians that share a covariance shrunk toward none.

Shapes: n examples of V classes, F features.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array

Indices = NDArray[np.intp]

_LEAST_SPREAD = 1e-9
"""A feature that varies less than this share of the one that varies most counts as constant."""


class Shrunk(NamedTuple):
    """A covariance, and how far it was shrunk."""

    covariance: Array
    """Shape (F, F)."""
    shrinkage: float
    """0: as the examples have it, 1: a multiple of the identity."""


class Discriminants(NamedTuple):
    """Gaussians that share a covariance."""

    means: Array
    """Shape (V, F)."""
    precision: Array
    """Inverse of the covariance, shape (F, F)."""

    def scores(self, vectors: Array) -> Array:
        """Return log densities of vectors, (n, F), but for what classes share, shape (n, V)."""
        difference = vectors[:, None] - self.means
        return np.asarray(
            -0.5 * np.einsum("nvf,fg,nvg->nv", difference, self.precision, difference)
        )


def ledoit_wolf(centered: Array) -> Shrunk:
    """Return the covariance of vectors of mean 0, shape (n, F), shrunk to a multiple of identity.

    The shrinkage has the least expected squared error (Ledoit and Wolf, A well-conditioned
    estimator for large-dimensional covariance matrices, 2004).
    """
    n, features = centered.shape
    covariance = centered.T @ centered / n
    level = float(np.trace(covariance)) / features
    distance = float((covariance**2).sum()) - features * level**2
    squares = centered**2
    error = (float((squares.T @ squares).sum()) / n - float((covariance**2).sum())) / n
    shrinkage = min(error, distance) / distance if distance > 0 else 0.0
    shrunk = (1.0 - shrinkage) * covariance + shrinkage * level * np.eye(features)
    return Shrunk(shrunk, shrinkage)


def shared_covariance(vectors: Array, classes: Indices) -> Array | None:
    """Return the covariance about the classes' means, shape (F, F), or None if nothing varies.

    Features are brought to the same spread, as `LinearDiscriminantAnalysis` of scikit-learn does,
    before they are shrunk. There the shrunk covariances of all classes are averaged; here all
    deviations are taken together first, which needs fewer examples of each.
    """
    residual = vectors - class_means(vectors, classes)[classes]
    spread = residual.std(axis=0)
    if not spread.any():
        return None
    spread[spread < _LEAST_SPREAD * spread.max()] = spread.max()
    shrunk = ledoit_wolf(residual / spread).covariance
    # Where nothing was shrunk, features that depend on each other still leave an inverse.
    shrunk = shrunk + 1e-9 * np.trace(shrunk) / len(shrunk) * np.eye(len(shrunk))
    return np.asarray(shrunk * np.outer(spread, spread))


def class_means(vectors: Array, classes: Indices) -> Array:
    """Return the means of classes 0 to V − 1, each with an example at least, shape (V, F)."""
    counts = np.bincount(classes)
    sums = np.zeros((len(counts), vectors.shape[1]))
    np.add.at(sums, classes, vectors)
    return np.asarray(sums / counts[:, None])
