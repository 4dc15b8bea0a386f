"""The forward filter of many hidden Markov models at once, online.

Shapes: M models of N states each, F dimensions. Models with fewer states are padded with states
that have no initial and no transition probability. Inside, models are the last axis: sums over
states and products with transitions then run along contiguous memory.
"""

from __future__ import annotations

import numpy as np

from hmcs.arrays import Array
from hmcs.recognition.hmm.densities import log_at_mean, log_gaussian
from hmcs.recognition.hmm.emissions import ModelError, ObservationError

LOST = 1e-300
"""A scaled probability below this counts as zero, so that its inverse still is a double."""


class ForwardBank:
    """P(state | observations so far) and log P(observations so far) of M models.

    It moves scaled probabilities of all models by one observation, without a loop over models;
    `inference` filters a whole sequence of one model in logarithms.

    A step costs O(MN²), or O(MN) where transitions lie on few diagonals, as those of left-right
    models do.
    """

    def __init__(self, initial: Array, transition: Array) -> None:
        """Filter with π, shape (M, N), and A, shape (M, N, N).

        Raises ModelError when the shapes do not fit.
        """
        initial, transition = np.asarray(initial), np.asarray(transition)
        if initial.ndim != 2 or transition.shape != (*initial.shape, initial.shape[1]):
            raise ModelError(
                f"initial of shape {initial.shape} and transition of shape {transition.shape}: "
                "give (M, N) and (M, N, N)"
            )
        states = initial.shape[1]
        self._initial = np.ascontiguousarray(initial.T)
        offsets = [
            offset
            for offset in range(1 - states, states)
            if np.diagonal(transition, offset, 1, 2).any()
        ]
        self._bands = None
        if 2 * len(offsets) <= states:
            self._bands = [
                (offset, np.ascontiguousarray(np.diagonal(transition, offset, 1, 2).T))
                for offset in offsets
            ]
        self._transition = np.ascontiguousarray(transition.transpose(1, 2, 0))
        self.reset()

    @property
    def states(self) -> Array:
        """P(state i | observations so far), shape (M, N); before any, π. Zero once impossible."""
        return np.ascontiguousarray(self._states.T)

    @property
    def log_likelihood(self) -> Array:
        """log P(observations so far), shape (M,)."""
        return self._log_likelihood.copy()

    def reset(self) -> None:
        """Forget all observations."""
        self._states = self._initial
        self._log_likelihood = np.zeros(self._initial.shape[1])
        self._begun = False

    def step(self, log_emission: Array) -> Array:
        """Take log P(o_t | state i), shape (M, N); return log P(o_t | o_1..o_{t−1}), shape (M,).

        −inf from the first impossible observation on. A state whose probability falls below 1e-300
        is lost from there on. Raises ObservationError when the shape is not that of the bank.
        """
        seen = np.asarray(log_emission).T
        if seen.shape != self._initial.shape:
            raise ObservationError(
                f"log emissions of shape {seen.T.shape}: give {self._initial.T.shape}"
            )
        predicted = self._predicted() if self._begun else self._initial
        possible = predicted >= LOST
        shifted = np.where(possible, seen, -np.inf)
        top = shifted.max(axis=0)
        top[~np.isfinite(top)] = 0.0
        shifted -= top
        joint = np.exp(shifted, out=shifted)
        joint *= predicted
        total = joint.sum(axis=0)
        with np.errstate(divide="ignore"):
            increment = np.asarray(np.log(total) + top)
        joint /= np.where(total > 0, total, 1.0)
        self._states, self._begun = joint, True
        self._log_likelihood = self._log_likelihood + increment
        return increment

    def _predicted(self) -> Array:
        if self._bands is None:
            return np.asarray(np.einsum("im,ijm->jm", self._states, self._transition))
        predicted = np.zeros_like(self._states)
        states = len(predicted)
        for offset, band in self._bands:
            low, high = max(0, -offset), states - max(0, offset)
            predicted[low + offset : high + offset] += self._states[low:high] * band
        return predicted


class GaussianScores:
    """The diagonal Gaussian log densities of one observation under all states of M models."""

    def __init__(self, means: Array, variances: Array) -> None:
        """Score with means and variances of shape (M, N, F).

        Raises ModelError when shapes differ or a variance is not above zero.
        """
        if means.ndim != 3 or means.shape != variances.shape or not (variances > 0).all():
            raise ModelError(
                f"means of shape {means.shape}, variances of shape {variances.shape}: give both "
                "as (M, N, F), variances above 0"
            )
        self._means = np.ascontiguousarray(means.transpose(2, 1, 0))
        self._half_precisions = np.ascontiguousarray((0.5 / variances).transpose(2, 1, 0))
        self._at_mean = np.ascontiguousarray(log_at_mean(variances).T)

    def log_emission(self, observation: Array) -> Array:
        """Return log N(observation; state i of model m), shape (M, N).

        `observation` has shape (F,), the same for all models, or (M, F). Raises ObservationError
        when it has another or holds a number that is not finite.
        """
        dimensions, _, models = self._means.shape
        vector = np.asarray(observation, dtype=np.float64)
        if vector.shape not in ((dimensions,), (models, dimensions)):
            raise ObservationError(
                f"observation of shape {vector.shape}: give ({dimensions},) or "
                f"({models}, {dimensions})"
            )
        if not np.isfinite(vector).all():
            raise ObservationError(f"observation {vector} is not finite: leave it out")
        return log_gaussian(self._at_mean, self._means, self._half_precisions, vector.T).T
