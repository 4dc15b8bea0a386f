"""How far probabilities can be taken at their word: reliability, calibration error, Brier score.

Probabilities are calibrated when of all that is said to have probability p a share p comes true.
Shapes: N predictions, S classes, B bins. Rows of probabilities may sum to less than one: what is
left is that none of the classes is true.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hmcs.arrays import Array

Integers = NDArray[np.int64]

BINS = 15


class Reliability(NamedTuple):
    """What was said and what came true, in bins of equal width from 0 to 1: a diagram's bars.

    A bin holds its upper edge, and the first one 0.
    """

    counts: Integers
    """Predictions in each bin, shape (B,)."""
    said: Array
    """Their mean probability, shape (B,); NaN in an empty bin."""
    came_true: Array
    """Share of them that came true, shape (B,); NaN in an empty bin."""

    @property
    def error(self) -> float:
        """Expected calibration error: mean over predictions of |said − came true| of their bin."""
        filled = self.counts > 0
        gaps = np.abs(self.said - self.came_true)[filled]
        return float(np.average(gaps, weights=self.counts[filled]))


def reliability(probabilities: ArrayLike, true: ArrayLike, bins: int = BINS) -> Reliability:
    """Return the reliability of the most probable class (Guo et al. 2017).

    `probabilities` have shape (N, S); `true` are the classes that were true, shape (N,).
    Raises ValueError for other shapes, probabilities out of [0, 1], no prediction, classes that
    are none, or no bin.
    """
    said, classes = _checked(probabilities, true)
    best = said.argmax(axis=1)
    return event_reliability(said[np.arange(len(said)), best], best == classes, bins)


def event_reliability(probability: ArrayLike, happened: ArrayLike, bins: int = BINS) -> Reliability:
    """Return the reliability of the probabilities (N,) of events that happened or did not, (N,).

    Raises ValueError as `reliability`.
    """
    said, outcome = np.asarray(probability, dtype=float), np.asarray(happened, dtype=float)
    if said.ndim != 1 or said.shape != outcome.shape or not len(said):
        raise ValueError(
            f"probabilities of shape {said.shape}, outcomes of shape {outcome.shape}: expected "
            "(N,) twice, N > 0"
        )
    if bins < 1:
        raise ValueError(f"bins is {bins}, expected one at least")
    _check_range(said)
    bin_of = np.clip(np.ceil(said * bins).astype(np.int64) - 1, 0, bins - 1)
    counts = np.bincount(bin_of, minlength=bins)
    with np.errstate(invalid="ignore"):
        return Reliability(
            counts,
            np.bincount(bin_of, said, bins) / counts,
            np.bincount(bin_of, outcome, bins) / counts,
        )


def all_classes_error(probabilities: ArrayLike, true: ArrayLike, bins: int = BINS) -> float:
    """Return the mean over all classes of their calibration errors (Nixon et al. 2019).

    Arguments and errors as `reliability`.
    """
    said, classes = _checked(probabilities, true)
    return float(
        np.mean([event_reliability(own, classes == k, bins).error for k, own in enumerate(said.T)])
    )


def brier_score(probabilities: ArrayLike, true: ArrayLike) -> float:
    """Return the mean squared distance of probabilities from the truth, from 0 to 2 (Brier 1950).

    Arguments and errors as `reliability`.
    """
    said, classes = _checked(probabilities, true)
    truth = classes[:, None] == np.arange(said.shape[1])
    return float(((said - truth) ** 2).sum(axis=1).mean())


def _checked(probabilities: ArrayLike, true: ArrayLike) -> tuple[Array, Integers]:
    said, classes = np.asarray(probabilities, dtype=float), np.asarray(true, dtype=np.int64)
    if said.ndim != 2 or classes.shape != said.shape[:1] or not said.size:
        raise ValueError(
            f"probabilities of shape {said.shape}, classes of shape {classes.shape}: expected "
            "(N, S) and (N,), none of them empty"
        )
    if classes.min() < 0 or classes.max() >= said.shape[1]:
        raise ValueError(
            f"true classes from {classes.min()} to {classes.max()}: expected 0 to "
            f"{said.shape[1] - 1}; leave out what has no true class"
        )
    _check_range(said)
    return said, classes


def _check_range(said: Array) -> None:
    # Sums of probabilities may pass one by rounding.
    if not ((said >= 0) & (said <= 1 + 1e-9)).all():
        raise ValueError("a probability is not between 0 and 1")
