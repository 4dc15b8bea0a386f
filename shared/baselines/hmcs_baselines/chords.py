"""Optimal chords: a motion cut into straight pieces by dynamic programming.

A straight piece of a hand's motion stays near a line, with an error that fades over some steps,
and goes along it at an even pace. For points i..j and a direction d (unit vector) the cost is

    Σ (1−φ)² |e⊥|² + φ |Δ⊥|² + w (Δ∥ − mean Δ∥)²,

e the points about their mean, Δ the steps between them, ⊥ and ∥ across and along d. The first two
terms are the errors of an autoregression of coefficient φ, so that successive errors do not count
as independent; the third tells a line there and back from a line. All is a quadratic form in d,
trace − dᵀQd, and the best direction is the principal eigenvector of Q. Both forms come from
cumulative sums for all (i, j) at once: time and memory grow with the square of the points (about
100 MB for 1000).
Shapes: T points, D axes, F = D(D+1)/2 entries of a symmetric matrix, K directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array

Integers = NDArray[np.intp]


class Piece(NamedTuple):
    """A stretch of a motion between two knots."""

    first: int
    """Index of the point it begins at."""
    last: int
    """Index of the point it ends at, where the next one begins."""
    line: int
    """Which line of a sequence it lies on."""


class Spread(NamedTuple):
    """How a hand errs about the lines it follows, m²."""

    across: float
    """Per step and axis across the line, after the autoregression."""
    along: float
    """Of the steps' lengths along the line."""


class Chords:
    """The cost of every stretch of one motion, for every direction."""

    def __init__(self, positions: Array, correlation: float) -> None:
        """Take positions, m, shape (T, D), and φ, from 0 up to but not including 1."""
        self.positions = positions - positions.mean(axis=0)
        self._rows, self._columns = np.triu_indices(positions.shape[1])
        points = _products(self.positions, self.positions, self._rows, self._columns)
        steps = np.diff(self.positions, axis=0, prepend=self.positions[:1])
        moved = _products(steps, steps, self._rows, self._columns)

        count = len(positions)
        last, first = np.arange(count)[:, None], np.arange(count)[None, :]
        held = np.maximum(last - first + 1, 1)
        total = _between(self.positions.T, inclusive=True)
        bent = _between(points, inclusive=True) - _outer(total, self._rows, self._columns) / held
        paced = _between(moved, inclusive=False)
        chord = self.positions.T[:, :, None] - self.positions.T[:, None, :]
        self._pace = paced - _outer(chord, self._rows, self._columns) / np.maximum(held - 1, 1)
        self._across = (1.0 - correlation) ** 2 * bent + correlation * paced
        self._diagonal = self._rows == self._columns
        self._trace = self._across[self._diagonal].sum(axis=0)
        self.weigh_pace(0.0)

    def weigh_pace(self, weight: float) -> None:
        """Set w."""
        self._form = self._across - weight * self._pace
        self._everything = self._trace + weight * self._pace[self._diagonal].sum(axis=0)

    def least_costs(self) -> Array:
        """Return the cost of each stretch on its own best line, [last, first], shape (T, T)."""
        count = len(self.positions)
        last, first = np.tril_indices(count, -1)
        largest = np.linalg.eigvalsh(self._matrices(self._form[:, last, first].T))[:, -1]
        costs = np.full((count, count), np.inf)
        costs[last, first] = np.maximum(self._trace[last, first] - largest, 0.0)
        return costs

    def costs(self, directions: Array) -> Array:
        """Return the cost of each stretch along each direction, [k, last, first], (K, T, T).

        A stretch that leads backward is not along the direction: all its scatter counts, which is
        more than it costs in any direction.
        """
        twice = np.where(self._diagonal, 1.0, 2.0)
        weights = directions[:, self._rows] * directions[:, self._columns] * twice
        explained = np.tensordot(weights, self._form, axes=1)
        along = directions @ self.positions.T
        forward = along[:, :, None] > along[:, None, :]
        costs = np.where(forward, self._trace - explained, self._everything)
        return np.asarray(np.maximum(costs, 0.0))

    def form(self, first: int, last: int) -> Array:
        """Return Q of a stretch, shape (D, D)."""
        return np.asarray(self._matrices(self._form[:, last, first][None])[0])

    def direction(self, first: int, last: int) -> Array:
        """Return the best direction of a stretch, shape (D,)."""
        towards = self.positions[last] - self.positions[first]
        return np.asarray(principal(self.form(first, last)[None], towards[None])[0])

    def spread(self, first: int, last: int) -> Spread:
        """Return how the hand errs in a stretch of four points or more."""
        across = self._matrices(self._across[:, last, first][None])[0]
        values, vectors = np.linalg.eigh(across)
        pace = self._matrices(self._pace[:, last, first][None])[0]
        along = float(vectors[:, -1] @ pace @ vectors[:, -1])
        freedom = last - first - 1
        return Spread(float(values[:-1].mean()) / freedom, along / freedom)

    def _matrices(self, entries: Array) -> Array:
        """Symmetric matrices (n, D, D) of their entries (n, F)."""
        axes = self.positions.shape[1]
        matrices = np.empty((len(entries), axes, axes))
        matrices[:, self._rows, self._columns] = entries
        matrices[:, self._columns, self._rows] = entries
        return matrices


def cut(costs: Array, penalty: float, least_steps: int) -> list[Piece]:
    """Return the pieces of least total cost when each costs `penalty` more: the exact optimum.

    `costs` is [last, first], (T, T), T > least_steps; no piece has fewer steps than `least_steps`.
    """
    count = len(costs)
    best = np.full(count, np.inf)
    best[0] = 0.0
    came_from = np.zeros(count, dtype=np.intp)
    for last in range(least_steps, count):
        stop = last - least_steps + 1
        totals = best[:stop] + costs[last, :stop]
        came_from[last] = totals.argmin()
        best[last] = totals[came_from[last]] + penalty
    knots = [count - 1]
    while knots[-1] > 0:
        knots.append(int(came_from[knots[-1]]))
    knots.reverse()
    return [Piece(a, b, n) for n, (a, b) in enumerate(pairwise(knots))]


class Fitted(NamedTuple):
    """A sequence of K lines laid over one motion."""

    cost: float
    """Of the best way."""
    pieces: tuple[Piece, ...]
    """Of the best way; lines left out have none."""
    cost_without: Array
    """The least cost when line k does not occur, shape (K,)."""


def lay(costs: Array, skip_penalty: float, least_steps: int) -> Fitted:
    """Lay K lines, in their order, over one motion at the least cost: exact.

    `costs` is [k, last, first], (K, T, T), T > least_steps. A line may be left out at a penalty.
    """
    lines, count, _ = costs.shape
    allowed = np.where(np.tri(count, k=-least_steps, dtype=bool), costs, np.inf)
    ahead = np.full((lines + 1, count), np.inf)
    ahead[0, 0] = 0.0
    came_from = np.zeros((lines + 1, count), dtype=np.intp)
    points = np.arange(count)
    for k in range(lines):
        totals = ahead[k] + allowed[k]
        came_from[k + 1] = totals.argmin(axis=1)
        ahead[k + 1] = totals[points, came_from[k + 1]]
        left_out = ahead[k] + skip_penalty
        skipped = left_out < ahead[k + 1]
        ahead[k + 1, skipped] = left_out[skipped]
        came_from[k + 1, skipped] = points[skipped]
    behind = np.full((lines + 1, count), np.inf)
    behind[lines, -1] = 0.0
    for k in range(lines - 1, -1, -1):
        used = (behind[k + 1][:, None] + allowed[k]).min(axis=0)
        behind[k] = np.minimum(used, behind[k + 1] + skip_penalty)
    pieces, here = [], count - 1
    for k in range(lines, 0, -1):
        before = int(came_from[k, here])
        if before != here:
            pieces.append(Piece(before, here, k - 1))
        here = before
    without = (ahead[:-1] + behind[1:]).min(axis=1)
    return Fitted(float(ahead[-1, -1]), tuple(reversed(pieces)), without)


def principal(forms: Array, towards: Array) -> Array:
    """Return the principal eigenvector of each form (K, D, D), on the side of `towards` (K, D)."""
    vectors = np.linalg.eigh(forms)[1][..., -1]
    return np.asarray(vectors * np.where((vectors * towards).sum(axis=1) < 0, -1.0, 1.0)[:, None])


def median_spread(pieces: Sequence[tuple[Chords, Piece]]) -> Spread:
    """Return the median of the pieces' spreads, each weighed by its number of steps."""
    spreads = np.array([chords.spread(piece.first, piece.last) for chords, piece in pieces])
    steps = np.array([piece.last - piece.first for _, piece in pieces])
    return Spread(*(_weighted_median(column, steps) for column in spreads.T))


def _weighted_median(values: Array, weights: Integers) -> float:
    order = values.argsort()
    below = weights[order].cumsum()
    return float(values[order][np.searchsorted(below, below[-1] / 2)])


def _products(a: Array, b: Array, rows: Integers, columns: Integers) -> Array:
    return np.asarray((a[:, rows] * b[:, columns]).T)


def _outer(vectors: Array, rows: Integers, columns: Integers) -> Array:
    return np.asarray(vectors[rows] * vectors[columns])


def _between(values: Array, *, inclusive: bool) -> Array:
    """Sums of values (F, T) over first..last or first+1..last, [last, first], shape (F, T, T)."""
    summed = values.cumsum(axis=1)
    before = summed - values if inclusive else summed
    return np.asarray(summed[:, :, None] - before[:, None, :])
