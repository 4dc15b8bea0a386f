"""Continuous observations: Gaussians and their mixtures (thesis 2.1.2).

Shapes: N states, T observations, F dimensions, K mixture components.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.hmm.observations import (
    ModelError,
    ObservationError,
    Observations,
    check_rows,
    checked_vectors,
    draw,
)


@dataclass(frozen=True, eq=False)
class Gaussian:
    """One diagonal Gaussian for each state (2.14); a sequence has shape (T, F)."""

    means: Array
    """Shape (N, F)."""
    variances: Array
    """σ², shape (N, F)."""
    variance_floor: float = 1e-6
    """No re-estimated variance is below this, in squared units of the observations."""

    def __post_init__(self) -> None:
        _check_gaussians(self.means, self.variances, self.variance_floor, "(N, F)", 2)

    @property
    def states(self) -> int:
        """N."""
        return len(self.means)

    def log_likelihood(self, observations: Observations) -> Array:
        """Return log densities, shape (T, N)."""
        return log_gaussians(
            self.means, self.variances, checked_vectors(observations, self.means.shape[-1])
        )

    def reestimated(self, sequences: Sequence[Observations], posteriors: Sequence[Array]) -> Self:
        """Return weighted means and variances over all sequences."""
        check_spread(sequences, self.variance_floor)
        means, variances = _moments(
            sequences, posteriors, self.means, self.variances, self.variance_floor
        )
        return replace(self, means=means, variances=variances)

    def drawn(self, path: NDArray[np.int64], rng: np.random.Generator) -> Observations:
        """Return a vector for each state of a path, shape (T, F)."""
        return rng.normal(self.means[path], np.sqrt(self.variances[path]))


@dataclass(frozen=True, eq=False)
class Mixture:
    """K diagonal Gaussians for each state (2.15, mean and σ with the index k); shape (T, F)."""

    weights: Array
    """c[i, k] = P(component k | state i), shape (N, K); rows sum to one."""
    means: Array
    """Shape (N, K, F)."""
    variances: Array
    """σ², shape (N, K, F)."""
    variance_floor: float = 1e-6
    """No re-estimated variance is below this, in squared units of the observations."""

    def __post_init__(self) -> None:
        _check_gaussians(self.means, self.variances, self.variance_floor, "(N, K, F)", 3)
        check_rows("component weights", self.weights)
        if self.weights.shape != self.means.shape[:2]:
            raise ModelError(
                f"weights of shape {self.weights.shape} for means of shape {self.means.shape}: "
                "give (N, K) and (N, K, F)"
            )

    @property
    def states(self) -> int:
        """N."""
        return len(self.weights)

    def log_likelihood(self, observations: Observations) -> Array:
        """Return log densities, shape (T, N)."""
        return np.asarray(np.logaddexp.reduce(self._log_joint(observations), axis=2))

    def reestimated(self, sequences: Sequence[Observations], posteriors: Sequence[Array]) -> Self:
        """Return weights, means and variances from each component's share of γ."""
        check_spread(sequences, self.variance_floor)
        states, components = self.weights.shape
        shares = []
        for sequence, posterior in zip(sequences, posteriors, strict=True):
            log_joint = self._log_joint(sequence)
            top = log_joint.max(axis=2, keepdims=True)
            share = np.exp(log_joint - np.where(np.isfinite(top), top, 0.0))
            # Divided by their own sum they are shares, however far the observation lies.
            total = share.sum(axis=2, keepdims=True)
            share *= posterior[:, :, None] / np.where(total > 0, total, 1.0)
            shares.append(share.reshape(len(sequence), states * components))
        flat = (states * components, -1)
        means, variances = _moments(
            sequences,
            shares,
            self.means.reshape(flat),
            self.variances.reshape(flat),
            self.variance_floor,
        )
        mass = np.sum([share.sum(axis=0) for share in shares], axis=0).reshape(self.weights.shape)
        weight = mass.sum(axis=1, keepdims=True)
        weights = np.where(weight > 0, mass / np.where(weight > 0, weight, 1.0), self.weights)
        shape = self.means.shape
        return replace(
            self,
            weights=weights,
            means=means.reshape(shape),
            variances=variances.reshape(shape),
        )

    def drawn(self, path: NDArray[np.int64], rng: np.random.Generator) -> Observations:
        """Return a vector for each state of a path, shape (T, F)."""
        component = draw(self.weights[path], rng)
        return rng.normal(self.means[path, component], np.sqrt(self.variances[path, component]))

    def _log_joint(self, observations: Observations) -> Array:
        """log P(component k, o_t | state i), shape (T, N, K)."""
        vectors = checked_vectors(observations, self.means.shape[-1])
        states, components, dimensions = self.means.shape
        flat = (states * components, dimensions)
        densities = log_gaussians(self.means.reshape(flat), self.variances.reshape(flat), vectors)
        with np.errstate(divide="ignore"):
            log_weights = np.log(self.weights)
        return np.asarray(densities.reshape(len(vectors), states, components) + log_weights)


def log_gaussians(means: Array, variances: Array, observations: Array) -> Array:
    """Return log N(observation; mean, diag variance), shape (T, N)."""
    at_mean = np.broadcast_to(log_at_mean(variances), (len(observations), len(means)))
    return log_gaussian(at_mean, means.T, 0.5 / variances.T, observations.T[:, :, None])


def log_at_mean(variances: Array) -> Array:
    """Return the log density of diagonal Gaussians at their means, shape (…) of (…, F)."""
    return np.asarray(-0.5 * np.log(2.0 * np.pi * variances).sum(axis=-1))


def log_gaussian(
    at_mean: Array,
    means: Iterable[Array],
    half_precisions: Iterable[Array],
    values: Iterable[Array],
) -> Array:
    """Return at_mean − Σ_f (value − mean)² / 2σ², of the shape of `at_mean`, the log at the means.

    Means, 1 / 2σ² and values come a dimension at a time, each of a shape that broadcasts to that:
    arrays of one dimension stay in the cache, where an array of all of them does not.
    """
    total = at_mean.copy()
    for mean, half_precision, value in zip(means, half_precisions, values, strict=True):
        term = value - mean
        term *= term
        term *= half_precision
        total -= term
    return total


def check_spread(sequences: Sequence[Observations], variance_floor: float) -> None:
    """Raise ObservationError when observations vary too little to learn variances from.

    With a variance floor one dimension that varies is enough; without, every one has to vary.
    """
    stacked = np.concatenate(sequences)
    constant = (stacked == stacked[0]).all(axis=0)
    if constant.all():
        raise ObservationError(
            f"all {len(stacked)} observations are equal: check that the recording moved, and give "
            "sequences that differ"
        )
    if variance_floor == 0 and constant.any():
        raise ObservationError(
            f"dimension {int(constant.argmax())} never varies and its variance would be 0: leave "
            "the dimension out or give a variance_floor"
        )


def _moments(
    sequences: Sequence[Array],
    weights: Sequence[Array],
    old_means: Array,
    old_variances: Array,
    variance_floor: float,
) -> tuple[Array, Array]:
    weight = np.sum([w.sum(axis=0) for w in weights], axis=0)[:, None]
    seen = weight > 1e-12
    safe = np.where(seen, weight, 1.0)
    pairs = list(zip(weights, sequences, strict=True))
    means = np.where(seen, np.sum([w.T @ o for w, o in pairs], axis=0) / safe, old_means)
    spread = np.sum(
        [np.einsum("tn,tnf->nf", w, (o[:, None, :] - means[None, :, :]) ** 2) for w, o in pairs],
        axis=0,
    )
    variances = np.where(seen, np.maximum(spread / safe, variance_floor), old_variances)
    return means, variances


def _check_gaussians(
    means: Array, variances: Array, variance_floor: float, shape: str, axes: int
) -> None:
    if means.ndim != axes or 0 in means.shape or variances.shape != means.shape:
        raise ModelError(
            f"means of shape {means.shape} and variances of shape {variances.shape}: give both as "
            f"{shape}"
        )
    if not np.isfinite(means).all():
        raise ModelError(f"the mean of state {np.argwhere(~np.isfinite(means))[0][0]} is no number")
    if not ((variances > 0) & np.isfinite(variances)).all():
        i = np.argwhere(~((variances > 0) & np.isfinite(variances)))[0][0]
        raise ModelError(
            f"a variance of state {i} is not above 0: give one, or learn with a variance_floor"
        )
    if not 0 <= variance_floor < np.inf:
        raise ModelError(f"variance_floor {variance_floor}: give 0 or more")
