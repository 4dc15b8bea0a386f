"""Windows of the last steps, and extremely randomised trees that classify them (Geurts, 2006)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import ExtraTreesClassifier

from hmcs.arrays import Array
from hmcs_laboratory.methods.features import directions

TREES = 100
LEAST_SHARE = 1e-3
"""A share of trees below this counts as this: no window alone rules a class out."""


class Window(NamedTuple):
    """What is seen of a motion after each step."""

    steps: int
    """How many of the last steps."""
    from_start: bool
    """Where the hand is: seen from where the motion began, or from the steps of the window."""

    def features(self, positions: Array, origin: Array) -> Array:
        """Return what is seen after each step between positions of shape (T, D), (T − 1, F).

        Where the hand is, from `origin`, (D,), or from where each of the last steps ended or
        the first position, newest first; and the directions of the last steps, newest first.
        Before the first position the hand has stood still.
        """
        dimensions = positions.shape[1]
        newest = np.arange(1, len(positions))
        padded = np.concatenate([np.zeros((self.steps, dimensions)), directions(positions)])
        moves = [padded[self.steps + newest - 1 - back] for back in range(self.steps)]
        here = positions[1:]
        if self.from_start:
            return np.hstack([here - origin, *moves])
        since = range(1, self.steps + 1)
        return np.hstack([*(here - positions[np.maximum(newest - b, 0)] for b in since), *moves])


FROM_START = Window(15, from_start=True)
LONG = Window(60, from_start=False)
"""Longer than most gestemes: which one came before is seen."""


def fit_window_trees(windows: Array, classes: NDArray[np.int64], rng: np.random.Generator) -> Any:
    """Return scikit-learn's `ExtraTreesClassifier` fitted to windows and their classes."""
    trees = ExtraTreesClassifier(TREES, n_jobs=1, random_state=int(rng.integers(2**31)))
    return trees.fit(windows, classes)


def log_shares(trees: Any, windows: Array) -> Array:
    """Return the logarithm of each class's share of the trees, shape (n, classes)."""
    return np.asarray(np.log(np.maximum(trees.predict_proba(windows), LEAST_SHARE)))
