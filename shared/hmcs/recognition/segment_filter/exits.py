"""When a gesteme ends: the probability of leaving it, from where the hand is and how it goes.

A left-right chain only knows how many phases are left. How far the hand is from the gesteme's end,
whether it has passed it, and whether it begins to turn tell more. A logistic regression on these
is shared by all gestemes of a model; it is learned from demonstrations left out, at their true
ends. Lengths are counted in steps, so it does not depend on units.
Shapes: p pairs of a gesteme and a start, D axes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array

LOWEST, HIGHEST = 2e-4, 0.95
"""No exit is surer than that."""

DEFAULT_WEIGHTS = np.array([1.5, -1.0, 0.0, -0.7, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0])
"""Where nothing can be left out: leave about where the path ends."""

_FAR_STEPS = 8.0
"""Farther than this is just far."""
_GATE_STEPS = 2.5
"""A turn counts as a sign of leaving within about so many steps of the end."""
_MOST_TURN = 4.0
_RIDGE = 0.05
_ITERATIONS = 30


def exit_features(remaining: Array, from_end: Array, normal: Array, innovation: Array) -> Array:
    """Return what the regression looks at, shape (p, 10).

    `remaining`: steps to the end by phase, (p,). `from_end`: place relative to the gesteme's end,
    in steps, (p, D). `normal`: unit direction in which it is passed, (p, D). `innovation`:
    direction of the step less the one expected, (p, D).
    """
    near = np.minimum(np.sqrt((from_end**2).sum(axis=1)), _FAR_STEPS)
    left = np.minimum(remaining, _FAR_STEPS)
    along = np.clip((from_end * normal).sum(axis=1), -_FAR_STEPS, 0.5 * _FAR_STEPS)
    gate = np.exp(-0.5 * (near / _GATE_STEPS) ** 2)
    turn = np.minimum((innovation**2).sum(axis=1), _MOST_TURN) * gate
    columns = (
        np.ones_like(near),
        near,
        near**2 / _FAR_STEPS,
        left,
        left**2 / _FAR_STEPS,
        along,
        along**2 / _FAR_STEPS,
        gate,
        turn,
        0.25 * turn * along,
    )
    return np.stack(columns, axis=1)


def exit_probability(weights: Array, features: Array) -> Array:
    """Return P(leaving before the next step), shape (p,)."""
    # Row by row: a matrix product would round by how many pairs there are.
    odds = np.clip((features * weights).sum(axis=1), -30.0, 30.0)
    return np.asarray(np.clip(1.0 / (1.0 + np.exp(-odds)), LOWEST, HIGHEST))


def fit_exit(features: Array, left: NDArray[np.bool_]) -> Array:
    """Return the weights of a ridge-regularized logistic regression, shape (10,).

    `features` are those after each step of segments whose ends are known, (n, 10), `left` is true
    for their last steps, (n,). Newton's method with bounded steps.
    """
    weights = np.zeros(features.shape[1])
    ridge = _RIDGE * np.eye(len(weights))
    for _ in range(_ITERATIONS):
        p = 1.0 / (1.0 + np.exp(-np.clip(features @ weights, -30.0, 30.0)))
        curvature = (features * (p * (1.0 - p))[:, None]).T @ features + ridge
        step = np.linalg.solve(curvature, features.T @ (left - p) - ridge @ weights)
        weights = weights + step * min(1.0, 3.0 / max(float(np.abs(step).max()), 1e-9))
    return weights
