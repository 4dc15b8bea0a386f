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

from hmcs.arrays import Array

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
_RECURSION_FROM = -1.0
"""Below it the recursion for j_k loses its digits; its continued fraction gains some there."""
_FRACTION_TERMS = 60


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
    along = (directions * means).sum(axis=1)
    integral = _scaled_integrals(along / np.sqrt(variances), dimensions)[dimensions - 1]
    # exp(m²/2), which the integrals lack for m > 0, takes away the share of v along d: what is left
    # is small where it counts, and the difference of two large squares would not tell it.
    aside = np.where((along > 0)[:, None], means - along[:, None] * directions, means)
    return np.asarray(
        np.log(integral)
        - 0.5 * (aside**2).sum(axis=1) / variances
        - 0.5 * dimensions * np.log(2.0 * np.pi)
    )


def lengths(directions: Array, means: Array, variances: Array) -> Lengths:
    """Return the moments of r given d; arguments as of `log_density`."""
    dimensions = directions.shape[1]
    scale = np.sqrt(variances)
    j = _scaled_integrals((directions * means).sum(axis=1) / scale, dimensions + 2)
    of_direction = j[dimensions - 1]
    return Lengths(
        scale * (j[dimensions] / of_direction), variances * (j[dimensions + 1] / of_direction)
    )


def _scaled_integrals(m: Array, count: int) -> list[Array]:
    """Return j_0 to j_{count − 1} of m, those of m > 0 times exp(−m²/2), each of shape (n,)."""
    near = np.maximum(m, _RECURSION_FROM)
    x = np.abs(near) / np.sqrt(2.0)
    t = 1.0 / (1.0 + 0.5 * x)
    below = np.sqrt(np.pi / 2.0) * t * np.exp(np.polyval(_ERFCX, t))
    fall = np.where(near > 0, np.exp(-0.5 * np.square(np.minimum(near, 40.0))), 1.0)
    first = np.where(near < 0, below, np.sqrt(2.0 * np.pi) - fall * below)
    values = [first, near * first + fall]
    while len(values) < count:
        k = len(values) - 1
        values.append(near * values[k] + k * values[k - 1])
    opposite = m < _RECURSION_FROM
    if opposite.any():
        for value, found in zip(values, _opposite_integrals(m[opposite], count), strict=False):
            value[opposite] = found
    return values[:count]


def _opposite_integrals(m: Array, count: int) -> list[Array]:
    """Return j_0 to j_{count − 1} of m < 0: j_k / j_{k−1} = k / (−m + j_{k+1} / j_k)."""
    ratio = 0.5 * (m + np.sqrt(m**2 + 4.0 * _FRACTION_TERMS))
    ratios = list[Array]()
    for k in range(_FRACTION_TERMS, 0, -1):
        ratio = k / (ratio - m)
        ratios.append(ratio)
    values = [1.0 / (ratio - m)]
    for k in range(1, count):
        values.append(values[-1] * ratios[-k])
    return values
