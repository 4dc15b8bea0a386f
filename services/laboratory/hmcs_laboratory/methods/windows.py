"""Windows of the last steps, and extremely randomised trees that classify them (Geurts, 2006)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import ExtraTreesClassifier

from hmcs_laboratory.methods.features import directions

Array = NDArray[np.float64]

WINDOW_STEPS = 15
TREES = 100
LEAST_SHARE = 1e-3
"""A share of trees below this counts as this: no window alone rules a class out."""


def windows_of(positions: Array, steps: int = WINDOW_STEPS) -> Array:
    """Return what is seen of the last steps after each step, shape (T − 1, (steps + 1) · D).

    For positions of shape (T, D): the displacement from the window's start, and the directions
    of its steps, newest first. Before the start the hand has stood still.
    """
    count, dimensions = len(positions) - 1, positions.shape[1]
    newest = np.arange(1, count + 1)
    moved = positions[1:] - positions[np.maximum(newest - steps, 0)]
    padded = np.concatenate([np.zeros((steps, dimensions)), directions(positions)])
    seen = [padded[steps + newest - 1 - back] for back in range(steps)]
    return np.hstack([moved, *seen])


def fit_window_trees(windows: Array, classes: NDArray[np.int64], rng: np.random.Generator) -> Any:
    """Return scikit-learn's `ExtraTreesClassifier` fitted to windows and their classes."""
    trees = ExtraTreesClassifier(
        TREES, min_samples_leaf=2, n_jobs=1, random_state=int(rng.integers(2**31))
    )
    return trees.fit(windows, classes)


def log_shares(trees: Any, windows: Array) -> Array:
    """Return the logarithm of each class's share of the trees, shape (n, classes)."""
    return np.asarray(np.log(np.maximum(trees.predict_proba(windows), LEAST_SHARE)))
