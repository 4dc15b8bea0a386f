"""Which gesteme is this: one gesteme whose start is known, seen whole or in part.

Two voices judge a motion. The closed loop (`closed_loop`) follows it step by step and knows how a
hand errs. The shape compares points along it, and how long it is, with those of the examples, as
linear discriminants with a shrunk covariance (`shrinkage`); a beginning is compared with the
beginnings of the same number of steps, and with how probable it is that the motion is not over
yet. Their log posteriors are added with weights learned on examples left out (a logarithmic
opinion pool), so that the result is calibrated.

A sample counts as a step: give positions after a dead zone or in equal steps, in learning and in
recognizing. Shapes: G gestemes, V variants of them, D axes, F features, K lengths of beginnings;
the unit of positions may be any, the same throughout.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs_laboratory.single_gestemes.closed_loop import (
    ClosedLoop,
    causal_log_likelihoods,
    log_likelihoods,
)
from hmcs_laboratory.single_gestemes.shape_vectors import beginning_vector, whole_vector
from hmcs_laboratory.single_gestemes.shrinkage import Discriminants

Indices = NDArray[np.intp]

VOICES = 2
"""The closed loop and the shape, in this order."""


class SingleGestemeError(UserError):
    """Motions that cannot be learned from or recognized; says which, why, and what to do."""


class Beginnings(NamedTuple):
    """Discriminants of beginnings; there may be none."""

    steps: Indices
    """Lengths of the beginnings, rising, shape (K,)."""
    means: Array
    """Shape (K, V, F)."""
    precisions: Array
    """Shape (K, F, F)."""


class Shapes(NamedTuple):
    """What motions look like as a whole."""

    points: int
    """Points along a whole motion that are compared."""
    beginning_points: int
    """Points along a beginning."""
    whole: Discriminants
    beginnings: Beginnings
    log_length: Array
    """Mean of the log of the number of steps, shape (V,)."""
    log_length_deviation: float
    """Standard deviation of the same."""


class SingleGestemes(NamedTuple):
    """What is known of gestemes."""

    variant_of: Indices
    """The gesteme of each variant, rising, shape (V,)."""
    log_prior: Array
    """Log of the share of its gesteme's examples that are of this variant, shape (V,)."""
    closed_loop: ClosedLoop
    shapes: Shapes
    whole_weights: Array
    """Of the voices, where the whole motion is seen, shape (2,)."""
    beginning_weights: Array
    """Of the voices, where a beginning is seen, shape (2,)."""


def scores(knowledge: SingleGestemes, positions: ArrayLike, *, whole: bool) -> Array:
    """Return log P(gesteme | motion), shape (G,), all gestemes equally probable beforehand.

    `positions` has shape (T, D), finite; it is from the start of a gesteme, and `whole` tells
    whether to its end. Of a part, one sample is enough: it tells nothing.
    Raises SingleGestemeError for positions of another shape, not finite, or whole without motion.
    """
    moved = checked_motion(positions, "positions", knowledge.closed_loop.normal.shape[1])
    if len(moved) > 1:
        weights = knowledge.whole_weights if whole else knowledge.beginning_weights
        return np.asarray(pooled(voices(knowledge, [moved], whole=whole), weights)[0])
    if whole:
        raise SingleGestemeError("positions never move: give a whole gesteme, or whole=False")
    return _undecided(knowledge)


def causal_scores(knowledge: SingleGestemes, positions: ArrayLike) -> Array:
    """Return log P(gesteme | motion up to each sample), shape (T, G).

    Row t is what `scores` returns of the part up to sample t. Raises what `scores` raises.
    """
    given = np.asarray(positions, dtype=np.float64)
    moved = checked_motion(given, "positions", knowledge.closed_loop.normal.shape[1])
    rows = np.empty((len(moved), _gestemes(knowledge)))
    rows[0] = _undecided(knowledge)
    if len(moved) > 1:
        loop = causal_log_likelihoods(knowledge.closed_loop, moved)
        shape = _shape_of_beginning(knowledge, moved, np.arange(1, len(moved)))
        each = np.stack([_posteriors(knowledge, loop), _posteriors(knowledge, shape)])
        rows[1:] = pooled(each, knowledge.beginning_weights)
    # At rest nothing changes.
    return np.asarray(rows[np.cumsum(_moves(given)) - 1])


def voices(knowledge: SingleGestemes, motions: Sequence[Array], *, whole: bool) -> Array:
    """Return log P(gesteme | motion) of each voice alone, shape (2, n, G).

    Motions are as `checked_motion` returns them, of two samples at least.
    """
    loop = log_likelihoods(knowledge.closed_loop, motions, whole=whole)
    if whole:
        shapes = knowledge.shapes
        vectors = [whole_vector(positions, shapes.points) for positions in motions]
        shape = shapes.whole.scores(np.stack(vectors))
    else:
        parts = [
            _shape_of_beginning(knowledge, positions, np.array([len(positions) - 1]))
            for positions in motions
        ]
        shape = np.concatenate(parts)
    return np.stack([_posteriors(knowledge, loop), _posteriors(knowledge, shape)])


def pooled(each: Array, weights: Array) -> Array:
    """Return the logarithmic opinion pool of voices, (W, n, G), with weights, (W,): (n, G)."""
    return _normalized(np.einsum("w,wng->ng", weights, each))


def checked_motion(positions: ArrayLike, name: str, dimensions: int | None) -> Array:
    """Return positions without those that equal the one before, shape (T, D).

    Raises SingleGestemeError, which calls them `name`, unless they are finite, of shape (T, D)
    with D as given, or 2 or 3 where it is not, and one at least.
    """
    try:
        given = np.asarray(positions, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise SingleGestemeError(f"{name} are no numbers of shape (T, D): {error}") from error
    axes = "2 or 3" if dimensions is None else str(dimensions)
    fits = given.ndim == 2 and (
        given.shape[1] in (2, 3) if dimensions is None else given.shape[1] == dimensions
    )
    if not fits:
        raise SingleGestemeError(
            f"{name} have shape {given.shape}, expected (T, D) with D {axes}: give a row a sample"
        )
    if not len(given):
        raise SingleGestemeError(f"{name} are empty: give a sample at least")
    if not np.isfinite(given).all():
        row = int(np.flatnonzero(~np.isfinite(given).all(axis=1))[0])
        raise SingleGestemeError(
            f"{name}: sample {row} is {given[row]}, expected finite numbers: leave it out"
        )
    return given[_moves(given)]


def _moves(positions: Array) -> NDArray[np.bool_]:
    """Whether each sample is elsewhere than the one before, shape (T,); the first is."""
    moved = (np.diff(positions, axis=0) != 0).any(axis=1)
    return np.concatenate([[True], moved])


def _gestemes(knowledge: SingleGestemes) -> int:
    return int(knowledge.variant_of[-1]) + 1


def _undecided(knowledge: SingleGestemes) -> Array:
    count = _gestemes(knowledge)
    return np.full(count, -np.log(count))


def _posteriors(knowledge: SingleGestemes, log_likelihood: Array) -> Array:
    """Log P(gesteme | motion), (n, G), of log P(motion | variant), (n, V)."""
    joint = log_likelihood + knowledge.log_prior
    first = np.flatnonzero(np.diff(knowledge.variant_of, prepend=-1))
    return _normalized(np.logaddexp.reduceat(joint, first, axis=1))


def _shape_of_beginning(knowledge: SingleGestemes, positions: Array, steps: Indices) -> Array:
    """Log P(first steps of a motion, and it goes on | variant), a row each number: (n, V).

    Numbers of steps rise. Points are compared of the longest beginning learned that is not longer;
    one shorter than all has none.
    """
    shapes = knowledge.shapes
    beginnings = shapes.beginnings
    found = np.zeros((len(steps), len(knowledge.variant_of)))
    learned = np.searchsorted(beginnings.steps, steps, side="right") - 1
    for k in np.unique(learned[learned >= 0]):
        vector = beginning_vector(positions, int(beginnings.steps[k]), shapes.beginning_points)
        known = Discriminants(beginnings.means[k], beginnings.precisions[k])
        found[learned == k] = known.scores(vector[None])[0]
    return found + _log_goes_on(shapes, steps)


def _log_goes_on(shapes: Shapes, steps: Indices) -> Array:
    """Log P(more than so many steps | variant), shape (n, V), lengths being log-logistic."""
    later = (np.log(steps)[:, None] - shapes.log_length) / shapes.log_length_deviation
    return np.asarray(-np.logaddexp(0.0, later * np.pi / np.sqrt(3.0)))


def _normalized(log_weights: Array) -> Array:
    return np.asarray(log_weights - np.logaddexp.reduce(log_weights, axis=-1, keepdims=True))
