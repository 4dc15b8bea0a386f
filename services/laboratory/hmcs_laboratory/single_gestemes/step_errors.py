"""How far the steps of hands are from those expected, where only directions are seen.

The step is y = v + √s Γ with standard normal Γ, or its opposite with probability f; its direction
is seen, unless it tells nothing, with probability o. Shapes: R steps, D axes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs_laboratory.single_gestemes.closed_loop import direction_densities
from hmcs_laboratory.single_gestemes.projected_normal import lengths


class Errors(NamedTuple):
    """Given the directions seen."""

    log_density: Array
    """Of the directions, shape (R,)."""
    mean: Array
    """E[y − v], shape (R, D)."""
    square: Array
    """E|y − v|², shape (R,)."""
    backwards: Array
    """P(opposite), shape (R,)."""
    meant: Array
    """P(it tells something), shape (R,)."""


class Spread(NamedTuple):
    """s and f that fit directions best."""

    variance: float
    backwards: float
    log_density: float
    """Mean over the steps."""


def errors(
    direction: Array, expected: Array, variance: Array, backwards: float, outlier: float
) -> Errors:
    """Return the errors of directions, (R, D), from v, (R, D), with s, (R,), f and o."""
    forth, back, nothing = direction_densities(direction, expected, variance, backwards, outlier)
    either = np.maximum(forth + back, 1e-300)
    mean, square = -expected, (expected**2).sum(axis=1)
    along = (direction * expected).sum(axis=1)
    for share, sign in ((forth / either, 1.0), (back / either, -1.0)):
        length = lengths(sign * direction, expected, variance)
        mean = mean + (share * sign * length.mean)[:, None] * direction
        square = square + share * (length.square - 2.0 * sign * length.mean * along)
    density = forth + back + nothing
    return Errors(np.log(density), mean, square, back / density, either / density)


def fitted_spread(
    direction: Array,
    expected: Array,
    begin: Spread,
    outlier: float,
    *,
    least_variance: float,
    iterations: int,
) -> Spread:
    """Return s and f after so many iterations of expectation maximization from `begin`.

    f never falls below 0.001, so that a step backwards is always possible.
    """
    spread = begin
    for _ in range(iterations):
        variances = np.full(len(direction), spread.variance)
        found = errors(direction, expected, variances, spread.backwards, outlier)
        mean_square = float((found.meant * found.square).sum() / found.meant.sum())
        spread = Spread(
            max(mean_square / direction.shape[1], least_variance),
            max(float(found.backwards.mean()), 1e-3),
            float(found.log_density.mean()),
        )
    return spread
