"""The projected normal distribution: the direction d = y / |y| of a normal vector y ~ N(v, s I).

With m = d·v / √s and j_k(m) = ∫₀^∞ ρᵏ exp(−ρ²/2 + ρm) dρ, its density on the unit sphere of D axes
is

    p(d) = (2π)^(−D/2) exp(−|v|² / 2s) j_{D−1}(m)

(Mardia and Jupp, Directional Statistics, 3.5.6), j₀ = Φ(m)/φ(m), j₁ = m j₀ + 1,
j_{k+1} = m j_k + k j_{k−1}. Length r = |y| given d has E[r] = √s j_D / j_{D−1} and
E[r²] = s j_{D+1} / j_{D−1}. Shapes: n directions; v and s are given for each of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Of exp(x²) erfc(x) for x > 0, relative error below 1.2e-7 (Numerical Recipes, 6.2).
_ERFCX = (
    0.17087277,
    -0.82215223,
    1.48851587,
    -1.13520398,
    0.27886807,
    -0.18628806,
    0.09678418,
    0.37409196,
    1.00002368,
    -1.26551223,
)
_FARTHEST = 30.0
"""|m| counts as no more: beyond, exp(m²/2) would overflow."""
_OPPOSITE = -6.0
"""Below it the recursion loses its digits; lengths there are those at it."""


class Lengths(NamedTuple):
    """Moments of the length r of y given its direction."""

    mean: Array
    """E[r], shape (n,)."""
    square: Array
    """E[r²], shape (n,)."""


def log_density(directions: Array, means: Array, variances: Array) -> Array:
    """Return log p(d) per steradian (radian in the plane), shape (n,).

    `directions` and `means` have shape (n, D), `variances` (n,), above 0.
    """
    dimensions = directions.shape[1]
    scaled = (directions * means).sum(axis=1) / np.sqrt(variances)
    integral = _integrals(np.clip(scaled, -_FARTHEST, _FARTHEST), dimensions)[dimensions - 1]
    return np.asarray(
        np.log(np.maximum(integral, 1e-300))
        - 0.5 * (means**2).sum(axis=1) / variances
        - 0.5 * dimensions * np.log(2.0 * np.pi)
    )


def lengths(directions: Array, means: Array, variances: Array) -> Lengths:
    """Return the moments of r given d; arguments as of `log_density`."""
    dimensions = directions.shape[1]
    scale = np.sqrt(variances)
    scaled = (directions * means).sum(axis=1) / scale
    j = _integrals(np.clip(scaled, _OPPOSITE, _FARTHEST), dimensions + 2)
    of_direction = j[dimensions - 1]
    return Lengths(
        scale * j[dimensions] / of_direction, variances * j[dimensions + 1] / of_direction
    )


def _integrals(m: Array, count: int) -> list[Array]:
    """Return j_0 to j_{count − 1} of m, each of shape (n,)."""
    x = np.abs(m) / np.sqrt(2.0)
    t = 1.0 / (1.0 + 0.5 * x)
    below = np.sqrt(np.pi / 2.0) * t * np.exp(np.polyval(_ERFCX, t))
    first = np.where(m < 0, below, np.sqrt(2.0 * np.pi) * np.exp(0.5 * m**2) - below)
    values = [first, m * first + 1.0]
    while len(values) < count:
        k = len(values) - 1
        values.append(m * values[k] + k * values[k - 1])
    return values[:count]
