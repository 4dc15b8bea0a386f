"""What a hidden Markov model observes: the protocol of its emissions, errors and checks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.errors import UserError

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


def check_rows(name: str, rows: Array) -> None:
    """Raise ModelError unless each row of probabilities, shape (N, …), sums to one."""
    if rows.ndim != 2 or 0 in rows.shape:
        raise ModelError(f"{name} of shape {rows.shape}: give one row for each state")
    wrong = ~((rows >= 0).all(axis=1) & (np.abs(rows.sum(axis=1) - 1.0) <= 1e-8))
    if wrong.any():
        i = int(wrong.argmax())
        raise ModelError(
            f"{name} of state {i} are {rows[i]}: give probabilities that sum to one "
            f"(these sum to {rows[i].sum():.10g})"
        )
