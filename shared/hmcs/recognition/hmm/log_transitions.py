"""Products with a transition matrix in logarithms, quickly where few transitions are possible.

The transitions of left-right models lie on few diagonals: then a product takes O(N) for each of
them instead of O(N²). Shapes: N states, T observations.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from hmcs.arrays import Array

_MOST_AT_ONCE = 1_000_000
"""Numbers in the largest array that is made for a sum over all pairs of states."""


def log_of(probabilities: Array) -> Array:
    """Return logarithms; −inf of zero."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(probabilities))


def log_sum(values: Array, axis: int) -> Array:
    """Return log Σ exp(values) along an axis; −inf where all are."""
    top = values.max(axis=axis, keepdims=True)
    safe = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore"):
        total = np.log(np.exp(values - safe).sum(axis=axis, keepdims=True)) + safe
    return np.asarray(total.squeeze(axis=axis))


class Ways(Protocol):
    """Products with a transition matrix A, shape (N, N), of logarithms."""

    def ahead(self, log_here: Array) -> Array:
        """Return log Σ_i exp(log_here_i) A_ij, shape (N,)."""
        ...

    def back(self, log_next: Array) -> Array:
        """Return log Σ_j A_ij exp(log_next_j), shape (N,)."""
        ...


class LogTransitions:
    """log A of a transition matrix A, shape (N, N)."""

    def __init__(self, transition: Array) -> None:
        states = len(transition)
        offsets = np.unique(np.diff(np.argwhere(transition > 0), axis=1))
        self._shape = transition.shape
        self._dense: Array | None = None
        self._bands: list[tuple[int, slice, slice, Array]] = []
        if 2 * len(offsets) > states:
            self._dense = log_of(transition)
            return
        for offset in offsets.tolist():
            low, high = max(0, -offset), states - max(0, offset)
            band = log_of(np.diagonal(transition, offset))
            self._bands.append((offset, slice(low, high), slice(low + offset, high + offset), band))

    def ahead(self, log_here: Array) -> Array:
        """Return log Σ_i exp(log_here_i) A_ij, shape (N,)."""
        if self._dense is not None:
            return log_sum(log_here[:, None] + self._dense, axis=0)
        ways = np.full((len(self._bands) + 1, len(log_here)), -np.inf)
        for row, (_, here, there, band) in zip(ways, self._bands, strict=False):
            np.add(log_here[here], band, out=row[there])
        return log_sum(ways, axis=0)

    def back(self, log_next: Array) -> Array:
        """Return log Σ_j A_ij exp(log_next_j), shape (N,)."""
        if self._dense is not None:
            return log_sum(self._dense + log_next[None, :], axis=1)
        ways = np.full((len(self._bands) + 1, len(log_next)), -np.inf)
        for row, (_, here, there, band) in zip(ways, self._bands, strict=False):
            np.add(log_next[there], band, out=row[here])
        return log_sum(ways, axis=0)

    def summed(self, log_here: Array, log_next: Array) -> Array:
        """Return Σ_t exp(log_here_ti) A_ij exp(log_next_tj), shape (N, N), of two arrays (T, N)."""
        total = np.zeros(self._shape)
        if self._dense is None:
            for offset, here, there, band in self._bands:
                found = np.exp(log_here[:, here] + band + log_next[:, there]).sum(axis=0)
                rows = np.arange(here.start, here.stop)
                total[rows, rows + offset] = found
            return total
        at_once = max(1, _MOST_AT_ONCE // total.size)
        for begin in range(0, len(log_here), at_once):
            part = slice(begin, begin + at_once)
            pairs = log_here[part, :, None] + self._dense + log_next[part, None, :]
            total += np.exp(pairs).sum(axis=0)
        return total
