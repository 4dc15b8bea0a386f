"""Emissions of many hidden Markov models in one, for `baum_welch_many`.

Shapes: M models of N states, T·K observations of each (K padded sequences, all of one step side by
side), F dimensions, S symbols.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.hmm.densities import log_at_mean, log_gaussian
from hmcs.recognition.hmm.emissions import Discrete, Gaussian, ModelError, floored

Mask = NDArray[np.bool_]
Integers = NDArray[np.int64]


class StackedEmissions(Protocol):
    """The emissions of M models in one."""

    def log_likelihood(self, observations: NDArray[Any]) -> Array:
        """Shape (M, N, T·K); anything in padding."""
        ...

    def reestimated(self, observations: NDArray[Any], states: Array, numbers: Integers) -> Self:
        """From γ, shape (M, N, T·K), zero in padding."""
        ...

    def only(self, kept: Mask) -> Self:
        """Those of some of the models, shape (M,)."""
        ...

    def of_model(self, at: int, like: Any) -> Any:
        """The emission of one model, otherwise like the one it began with."""
        ...


@dataclass(frozen=True, eq=False)
class _Gaussians:
    means: Array
    """Shape (M, N, F)."""
    variances: Array
    """Shape (M, N, F)."""
    floors: Array
    """Shape (M,)."""

    def log_likelihood(self, observations: NDArray[Any]) -> Array:
        at_mean = log_at_mean(self.variances)[:, :, None]
        return log_gaussian(
            np.broadcast_to(at_mean, (*at_mean.shape[:2], observations.shape[2])),
            np.moveaxis(self.means, 2, 0)[..., None],
            np.moveaxis(0.5 / self.variances, 2, 0)[..., None],
            observations.swapaxes(0, 1)[:, :, None],
        )

    def reestimated(self, observations: NDArray[Any], states: Array, numbers: Integers) -> Self:
        weight = states.sum(axis=2)[:, :, None]
        seen = weight > 1e-12
        safe = np.where(seen, weight, 1.0)
        means = np.where(seen, states @ observations.swapaxes(1, 2) / safe, self.means)
        spread = np.empty_like(means)
        for f in range(means.shape[2]):
            term = observations[:, f, None] - means[:, :, f, None]
            term *= term
            spread[:, :, f] = np.einsum("mns,mns->mn", states, term)
        lowest = self.floors[:, None, None]
        variances = np.where(seen, np.maximum(spread / safe, lowest), self.variances)
        if not (variances > 0).all():
            at, state, f = np.argwhere(~(variances > 0))[0]
            raise ModelError(
                f"model {numbers[at]}: the variance of state {state} in dimension {f} becomes 0: "
                "learn with a variance_floor"
            )
        return replace(self, means=means, variances=variances)

    def only(self, kept: Mask) -> Self:
        return replace(
            self, means=self.means[kept], variances=self.variances[kept], floors=self.floors[kept]
        )

    def of_model(self, at: int, like: Gaussian) -> Gaussian:
        return replace(like, means=self.means[at], variances=self.variances[at])


@dataclass(frozen=True, eq=False)
class _Discretes:
    probabilities: Array
    """Shape (M, N, S)."""
    floors: Array
    """Shape (M,)."""

    def log_likelihood(self, observations: NDArray[Any]) -> Array:
        with np.errstate(divide="ignore"):
            log_probabilities = np.log(self.probabilities)
        return np.take_along_axis(log_probabilities, observations[:, None], axis=2)

    def reestimated(self, observations: NDArray[Any], states: Array, numbers: Integers) -> Self:
        models, count, symbols = self.probabilities.shape
        row = np.arange(models * count).reshape(models, count, 1)
        cell = symbols * row + observations[:, None]
        counts = np.bincount(cell.ravel(), states.ravel(), models * count * symbols)
        counts = counts.reshape(models, count, symbols)
        weight = counts.sum(axis=2, keepdims=True)
        share = counts / np.where(weight > 0, weight, 1.0)
        floors = np.repeat(self.floors, count)[:, None]
        rows = floored(share.reshape(models * count, symbols), floors).reshape(counts.shape)
        return replace(self, probabilities=np.where(weight > 0, rows, self.probabilities))

    def only(self, kept: Mask) -> Self:
        return replace(self, probabilities=self.probabilities[kept], floors=self.floors[kept])

    def of_model(self, at: int, like: Discrete) -> Discrete:
        return replace(like, probabilities=self.probabilities[at])


def stacked(emissions: Sequence[Discrete | Gaussian]) -> StackedEmissions:
    """Return the emissions of models of one kind and shape, in one."""
    parameters = np.stack([parameters_of(emission) for emission in emissions])
    gaussians = [emission for emission in emissions if isinstance(emission, Gaussian)]
    if gaussians:
        return _Gaussians(
            parameters,
            np.stack([emission.variances for emission in gaussians]),
            np.array([emission.variance_floor for emission in gaussians]),
        )
    discretes = [emission for emission in emissions if isinstance(emission, Discrete)]
    return _Discretes(parameters, np.array([emission.floor for emission in discretes]))


def parameters_of(emission: Discrete | Gaussian) -> Array:
    """Return the array whose shape all emissions of a stack share."""
    return emission.means if isinstance(emission, Gaussian) else emission.probabilities
