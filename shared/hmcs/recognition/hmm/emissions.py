"""Observation probabilities of hidden Markov models: P(observation | state) (thesis 2.1.2).

Shapes: N states, T observations, F dimensions of continuous observations, M symbols, K mixture
components. Each kind is frozen; learning returns a new one.

Of all parameters that respect a floor, re-estimation gives the most likely, so that a floor never
makes the likelihood of the training sequences fall from one iteration to the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from hmcs.errors import UserError
from hmcs.recognition.hmm.inference import Array

Observations = NDArray[Any]
"""One sequence; its first axis is time."""


class ModelError(UserError, ValueError):
    """Parameters that are no model; says which, where, and what is expected."""


class ObservationError(UserError, ValueError):
    """Observations that a model cannot take; says which, where, and what to do."""


class Emission(Protocol):
    """What a hidden Markov model needs to know of its observations."""

    @property
    def states(self) -> int:
        """N."""
        ...

    def log_likelihood(self, observations: Observations) -> Array:
        """Return log P(o_t | state i), shape (T, N).

        Raises ObservationError when the observations are not of this kind.
        """
        ...

    def reestimated(self, sequences: Sequence[Observations], posteriors: Sequence[Array]) -> Self:
        """Return the emission that makes the sequences most likely under given posteriors.

        `posteriors` holds γ of each sequence, shape (T, N). A state with no weight keeps what it
        has. Raises ObservationError when the sequences determine no emission.
        """
        ...


class DrawingEmission(Emission, Protocol):
    """An emission that observations can be drawn from."""

    def drawn(self, path: NDArray[np.int64], rng: np.random.Generator) -> Observations:
        """Return one observation for each state of a path, shape (T, …)."""
        ...


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
        _check_rows("symbol probabilities", self.probabilities)
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
        _check_rows("component weights", self.weights)
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
            total = np.logaddexp.reduce(log_joint, axis=2)
            share = np.exp(log_joint - total[:, :, None]) * posterior[:, :, None]
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
            return densities.reshape(len(vectors), states, components) + np.log(self.weights)


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
        _check_rows("state shares", self.state_shares[None])
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


def log_gaussians(means: Array, variances: Array, observations: Array) -> Array:
    """Return log N(observation; mean, diag variance), shape (T, N)."""
    difference = observations[:, None, :] - means[None, :, :]
    terms = difference**2 / variances + np.log(2.0 * np.pi * variances)
    return np.asarray(-0.5 * terms.sum(axis=2))


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


def draw(rows: Array, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return one index for each row of probabilities, shape (T,), given rows of shape (T, M)."""
    cumulative = rows.cumsum(axis=1)
    aim = rng.random(len(rows)) * cumulative[:, -1]
    return np.asarray((cumulative <= aim[:, None]).sum(axis=1), dtype=np.int64)


def checked_vectors(observations: Observations, dimensions: int) -> Array:
    """Return finite observations of shape (T, dimensions); raises ObservationError otherwise."""
    vectors = np.asarray(observations, dtype=np.float64)
    if vectors.ndim != 2 or vectors.shape[1] != dimensions:
        raise ObservationError(
            f"observations of shape {vectors.shape}: give (T, {dimensions}), as the model has"
        )
    bad = ~np.isfinite(vectors)
    if bad.any():
        t, f = (int(k) for k in np.argwhere(bad)[0])
        raise ObservationError(
            f"observation {t} is {vectors[t, f]} in dimension {f}: repair it or cut the sequence "
            "there"
        )
    return vectors


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


def _check_rows(name: str, rows: Array) -> None:
    if rows.ndim != 2 or 0 in rows.shape:
        raise ModelError(f"{name} of shape {rows.shape}: give one row for each state")
    wrong = ~((rows >= 0).all(axis=1) & (np.abs(rows.sum(axis=1) - 1.0) <= 1e-8))
    if wrong.any():
        i = int(wrong.argmax())
        raise ModelError(
            f"{name} of state {i} are {rows[i]}: give probabilities that sum to one "
            f"(these sum to {rows[i].sum():.10g})"
        )


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
