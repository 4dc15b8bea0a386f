"""One sequence of lines laid over several demonstrations of a task (see `directions`).

Shapes: K lines, D axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs_baselines.chords import Chords, Fitted, Piece, lay, principal

Integers = NDArray[np.intp]


class LineSequence(NamedTuple):
    """Lines laid over all demonstrations."""

    lines: Array
    """Direction of each line, shape (K, D)."""
    fitted: tuple[Fitted, ...]
    """How they lie over each demonstration."""

    @property
    def cost(self) -> float:
        """Of all demonstrations together, m²."""
        return sum(one.cost for one in self.fitted)

    def counts(self) -> Integers:
        """Return in how many demonstrations each line occurs, shape (K,)."""
        present = [piece.line for one in self.fitted for piece in one.pieces]
        return np.bincount(np.array(present, dtype=np.intp), minlength=len(self.lines))


class Laying(NamedTuple):
    """How lines may lie over a demonstration."""

    skip_penalty: float
    """What leaving out a line costs, m²."""
    least_steps: int
    """No line has fewer."""


def laid_over_all(motions: Sequence[Chords], lines: Array, laying: Laying) -> LineSequence:
    """Lay lines (K, D) over all demonstrations and fit their directions, in turn, until settled."""
    settled: LineSequence | None = None
    while True:
        laid = LineSequence(lines, tuple(lay(c.costs(lines), *laying) for c in motions))
        if settled is not None and settled.cost - laid.cost <= 1e-3 * settled.cost:
            return min(settled, laid, key=lambda sequence: sequence.cost)
        settled = laid
        forms, chords = gathered(motions, laid)
        used = np.asarray(forms.any(axis=(1, 2), keepdims=True))[:, 0]
        lines = np.where(used, principal(forms, chords), lines)


def without_one(
    motions: Sequence[Chords], sequence: LineSequence, laying: Laying, least_count: float
) -> LineSequence:
    """Return the best sequence with one line less.

    A line that occurs in fewer demonstrations than `least_count` goes first; of the others, the two
    that look most dispensable are tried.
    """
    counts = sequence.counts()
    if counts.min() < least_count:
        candidates = [int(counts.argmin())]
    else:
        costs = np.sum([one.cost_without for one in sequence.fitted], axis=0)
        candidates = [int(k) for k in costs.argsort()[:2]]
    shorter = [
        laid_over_all(motions, np.delete(sequence.lines, k, axis=0), laying) for k in candidates
    ]
    return min(shorter, key=lambda fewer: fewer.cost)


def gathered(motions: Sequence[Chords], sequence: LineSequence) -> tuple[Array, Array]:
    """Return Q (K, D, D) and chord (K, D), m, of all pieces of each line together."""
    count, axes = sequence.lines.shape
    forms, chord = np.zeros((count, axes, axes)), np.zeros((count, axes))
    for chords, one in zip(motions, sequence.fitted, strict=True):
        for piece in one.pieces:
            forms[piece.line] += chords.form(piece.first, piece.last)
            chord[piece.line] += trimmed_chord(chords, piece)
    return forms, chord


def trimmed_chord(chords: Chords, piece: Piece) -> Array:
    """Return the chord from a piece's second point to its last but one: hands round corners."""
    return np.asarray(chords.positions[piece.last - 1] - chords.positions[piece.first + 1])
