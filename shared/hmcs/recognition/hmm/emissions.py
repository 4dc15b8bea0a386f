"""Observation probabilities of hidden Markov models: P(observation | state) (thesis 2.1.2).

All kinds, whose protocol is `Emission`, are named here; those of symbols and of classifiers stand
here. Each is frozen; learning returns a new one. Of all parameters that respect a floor,
re-estimation gives the most likely, so that a floor never makes the likelihood of the training
sequences fall from one iteration to the next.

Shapes: N states, T observations, F dimensions of continuous observations, M symbols.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.hmm.densities import Gaussian, Mixture, check_spread, log_gaussians
from hmcs.recognition.hmm.observations import (
    DrawingEmission,
    Emission,
    ModelError,
    ObservationError,
    Observations,
    check_rows,
    checked_vectors,
    draw,
)

__all__ = [
    "Discrete",
    "DrawingEmission",
    "Emission",
    "Estimated",
    "Gaussian",
    "Mixture",
    "ModelError",
    "MultiDiscrete",
    "ObservationError",
    "Observations",
    "check_spread",
    "checked_vectors",
    "draw",
    "floored",
    "log_gaussians",
]


@dataclass(frozen=True, eq=False)
class Discrete:
    """Symbols 0 to M − 1; an observation sequence holds integers, shape (T,)."""

    probabilities: Array
    """B[i, k] = P(symbol k | state i), shape (N, M); rows sum to one."""
    floor: float = 0.0
    """No re-estimated probability is below this, and rows still sum to one. A symbol not seen in
    training then costs a state at most −ln(floor). With a floor above zero no zero of B is
    structural; with zero, a zero of B stays."""

    def __post_init__(self) -> None:
        check_rows("symbol probabilities", self.probabilities)
        if not 0.0 <= self.floor * self.probabilities.shape[1] <= 1.0:
            raise ModelError(
                f"floor {self.floor} with {self.probabilities.shape[1]} symbols: it must be from "
                f"0 to 1/{self.probabilities.shape[1]}"
            )

    @property
    def states(self) -> int:
        """N."""
        return len(self.probabilities)

    def log_likelihood(self, observations: Observations) -> Array:
        """Return log B[i, o_t], shape (T, N); raises ObservationError naming a foreign symbol."""
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(self.probabilities.T[self.checked(observations)]))

    def reestimated(self, sequences: Sequence[Observations], posteriors: Sequence[Array]) -> Self:
        """Return (2.13) summed over sequences, floored."""
        counts = np.zeros_like(self.probabilities)
        for observations, posterior in zip(sequences, posteriors, strict=True):
            np.add.at(counts.T, observations, posterior)
        return self.from_counts(counts)

    def from_counts(self, counts: Array) -> Self:
        """Return the most likely B for expected counts of symbols in states, shape (N, M)."""
        weight = counts.sum(axis=1, keepdims=True)
        share = counts / np.where(weight > 0, weight, 1.0)
        rows = np.where(weight > 0, floored(share, self.floor), self.probabilities)
        return replace(self, probabilities=rows)

    def drawn(self, path: NDArray[np.int64], rng: np.random.Generator) -> Observations:
        """Return a symbol for each state of a path, shape (T,)."""
        return draw(self.probabilities[path], rng)

    def checked(self, observations: Observations) -> Observations:
        """Return the symbols if they are of this kind; raises ObservationError otherwise."""
        symbols = np.asarray(observations)
        if symbols.ndim != 1 or not np.issubdtype(symbols.dtype, np.integer):
            raise ObservationError(
                f"symbols of shape {symbols.shape} and type {symbols.dtype}: give integers, "
                "shape (T,)"
            )
        count = self.probabilities.shape[1]
        foreign = (symbols < 0) | (symbols >= count)
        if foreign.any():
            t = int(foreign.argmax())
            raise ObservationError(
                f"observation {t} is symbol {symbols[t]}, but the model knows 0 to {count - 1}: "
                "use the code book it was made with"
            )
        return symbols


@dataclass(frozen=True, eq=False)
class MultiDiscrete:
    """D symbols at a time, independent given the state; a sequence holds integers, shape (T, D)."""

    dimensions: tuple[Discrete, ...]
    """One B for each dimension, all of the same N; their numbers of symbols may differ."""

    def __post_init__(self) -> None:
        if not self.dimensions:
            raise ModelError("no dimensions: give one matrix of symbol probabilities for each")
        if len({dimension.states for dimension in self.dimensions}) > 1:
            numbers = [dimension.states for dimension in self.dimensions]
            raise ModelError(f"dimensions with {numbers} states: give all of them the same number")

    @property
    def states(self) -> int:
        """N."""
        return self.dimensions[0].states

    def log_likelihood(self, observations: Observations) -> Array:
        """Return Σ_d log B_d[i, o_{d,t}], shape (T, N)."""
        symbols = np.asarray(observations)
        if symbols.ndim != 2 or symbols.shape[1] != len(self.dimensions):
            raise ObservationError(
                f"observations of shape {symbols.shape}: give (T, {len(self.dimensions)}), one "
                "symbol for each dimension"
            )
        total = np.zeros((len(symbols), self.states))
        for d, (dimension, column) in enumerate(zip(self.dimensions, symbols.T, strict=True)):
            try:
                total += dimension.log_likelihood(column)
            except ObservationError as error:
                raise ObservationError(f"dimension {d}: {error}") from error
        return total

    def reestimated(self, sequences: Sequence[Observations], posteriors: Sequence[Array]) -> Self:
        """Return each dimension re-estimated by itself."""
        dimensions = tuple(
            dimension.reestimated([sequence[:, d] for sequence in sequences], posteriors)
            for d, dimension in enumerate(self.dimensions)
        )
        return replace(self, dimensions=dimensions)

    def drawn(self, path: NDArray[np.int64], rng: np.random.Generator) -> Observations:
        """Return D symbols for each state of a path, shape (T, D)."""
        return np.stack([dimension.drawn(path, rng) for dimension in self.dimensions], axis=1)


@dataclass(frozen=True, eq=False)
class Estimated:
    """A classifier's P(state | x) in place of P(x | state); a sequence has shape (T, N).

    By Bayes' rule P(x | state) is P(state | x) / P(state) but for P(x), which is the same for all
    states (Bourlard and Morgan 1990). Likelihoods therefore compare paths of one model, and models
    only if they share the classifier's input.
    """

    state_shares: Array
    """P(state) in what the classifier was trained on, shape (N,); above zero, sums to one."""

    def __post_init__(self) -> None:
        check_rows("state shares", self.state_shares[None])
        if not (self.state_shares > 0).all():
            raise ModelError(
                f"state {int(self.state_shares.argmin())} has share 0: leave out states that the "
                "classifier was not trained on"
            )

    @property
    def states(self) -> int:
        """N."""
        return len(self.state_shares)

    def log_likelihood(self, observations: Observations) -> Array:
        """Return log P(state i | x_t) − log P(state i), shape (T, N)."""
        rows = checked_vectors(observations, self.states)
        wrong = (rows < 0).any(axis=1) | (np.abs(rows.sum(axis=1) - 1.0) > 1e-6)
        if wrong.any():
            t = int(wrong.argmax())
            raise ObservationError(
                f"observation {t} is {rows[t]}: give P(state | x) of each state, which sum to one"
            )
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(rows) - np.log(self.state_shares))

    def reestimated(self, sequences: Sequence[Observations], posteriors: Sequence[Array]) -> Self:
        """Return this very emission: a classifier is trained by itself, not by Baum–Welch."""
        return self


def floored(rows: Array, floor: float | Array) -> Array:
    """Return the rows p maximizing Σ q log p over p ≥ floor, Σ p = 1, for rows q, (R, M).

    Entries that would be below the floor lie on it; the others keep their proportions. The floor
    is one for all, or one for each row, shape (R, 1).
    """
    low = np.zeros(rows.shape, dtype=bool)
    result = rows
    while np.any(floor):
        free = np.where(low, 0.0, rows).sum(axis=1, keepdims=True)
        left = 1.0 - floor * low.sum(axis=1, keepdims=True)
        scaled = rows * left / np.where(free > 0, free, 1.0)
        result = np.where(low, floor, scaled)
        sinking = ~low & (scaled < floor)
        if not sinking.any():
            break
        low |= sinking
    return result
