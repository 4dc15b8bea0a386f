"""A path cut into straight lines and arcs of circles, where they explain it best.

Every piece is travelled at an even pace: a line is p + v·s, an arc c + r·e^{iωs} in a plane of its
own, s counted in steps. Both can be fitted to any stretch by sums over it alone, so all stretches
are fitted at once from running sums, and the best cut is found exactly by dynamic programming.
A boundary stands where the direction breaks or the curvature changes.
Shapes: N points of the path, P stretches.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array

Integers = NDArray[np.int64]

_TURNS_RAD = np.geomspace(0.015, 0.6, 48)
"""ω: how far an arc turns with each step, rad; a radius of 1.7 to 67 steps."""
_LEAST_BEND_RAD = 0.5
"""An arc that turns by less in all is a line."""
_TRIM = 1
"""A stretch does not answer for so many points beside its boundaries: hands cut corners."""
_FLAT = 1e-6
"""A path lies in a plane when its variance across it is this share of the greatest, or less."""


class Stretches(NamedTuple):
    """All stretches of a path that a piece may take, and how far lines and arcs lie from them."""

    first: Integers
    """Index of the point each begins at, shape (P,)."""
    last: Integers
    """...and ends at."""
    line: Array
    """Sum of squared distances from the best line, shape (P,)."""
    arc: Array
    """...and from the best arc; infinite where it would be a line."""
    axes: int
    """Of the space the path fills: 2 where it lies in a plane."""


def stretches_of(path: Array, least_steps: int) -> Stretches:
    """Fit a line and an arc to every stretch of at least so many steps of a path, shape (N, 3).

    The whole path is a stretch, however short.
    """
    count = len(path)
    path = path - path.mean(axis=0)
    first, last = np.triu_indices(count, min(max(least_steps, 1), count - 1))
    begin = np.where(first > 0, first + _TRIM, first)
    end = np.where(last < count - 1, last - _TRIM, last) + 1
    clear = (end - begin >= 3) | (last - first == count - 1)
    first, last, begin, end = first[clear], last[clear], begin[clear], end[clear]
    points = (end - begin).astype(float)

    def summed(values: NDArray[Any]) -> NDArray[Any]:
        running = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values, axis=0)])
        return np.asarray(running[end] - running[begin])

    total = summed(path)
    scatter = summed(path[:, :, None] * path[:, None, :])
    scatter -= total[:, :, None] * total[:, None, :] / points[:, None, None]
    squares = np.trace(scatter, axis1=1, axis2=2)

    s = np.arange(count) - (count - 1) / 2
    s_total = summed(s)
    s_squares = summed(s**2) - s_total**2 / points
    along = summed(s[:, None] * path) - (s_total / points)[:, None] * total
    line = squares - (along**2).sum(axis=1) / s_squares

    arc = np.full(len(first), np.inf)
    plane = np.linalg.eigh(scatter)[1][:, :, -2:]
    for turn_rad in _TURNS_RAD:
        bent = turn_rad * (points - 1) >= _LEAST_BEND_RAD
        wheel = np.exp(1j * turn_rad * s)
        turned = summed(wheel) / points
        across = summed(wheel[:, None] * path) - turned[:, None] * total
        across = np.einsum("pd,pdk->pk", across, plane)
        weight = points * (1 - np.abs(turned) ** 2)
        for sense in (1j, -1j):
            explained = np.abs(across[:, 0] + sense * across[:, 1]) ** 2 / weight
            arc = np.where(bent, np.minimum(arc, squares - explained), arc)
    return Stretches(first, last, np.maximum(line, 0.0), np.maximum(arc, 0.0), axes_filled(path))


def axes_filled(path: Array) -> int:
    """Return 2 for a path of shape (N, 3) that lies in a plane, else 3."""
    spread = np.linalg.eigvalsh(np.cov(path.T))
    return 2 if spread[0] <= _FLAT * spread[-1] else 3


def cut(stretches: Stretches, variance: float, penalty: float) -> Integers:
    """Return the knots of the best cut of the whole path: indices of points, ends included.

    A cut costs its squared distances over the variance of an independent point along one axis, and
    the penalty times log N for each parameter of its pieces; penalty 1 is the Bayesian information
    criterion.
    """
    count = int(stretches.last.max()) + 1
    line, arc = parameters(stretches.axes)
    each = penalty * np.log(max(count, 2))
    cost = np.full((count, count), np.inf)
    cost[stretches.last, stretches.first] = np.minimum(
        stretches.line / variance + each * line, stretches.arc / variance + each * arc
    )
    best, behind = np.full(count, np.inf), np.zeros(count, dtype=np.int64)
    best[0] = 0.0
    for end in range(1, count):
        through = best[:end] + cost[end, :end]
        behind[end] = through.argmin()
        best[end] = through[behind[end]]
    knots = [count - 1]
    while knots[-1] > 0:
        knots.append(int(behind[knots[-1]]))
    return np.array(knots[::-1], dtype=np.int64)


def parameters(axes: int) -> tuple[int, int]:
    """Return how many numbers a line and an arc are described by, the knot they end at included."""
    return 2 * axes + 1, 3 * axes


def fitted(path: Array) -> Array:
    """Return the points of the line or arc that lies nearest to a path travelled at an even pace.

    Shapes (N, 3); the line where an arc is no nearer.
    """
    count = len(path)
    center = path.mean(axis=0)
    moved = path - center
    s = np.arange(count) - (count - 1) / 2
    best = np.outer(s, s @ moved) / (s @ s)
    least = float(((moved - best) ** 2).sum())
    plane = np.linalg.eigh(moved.T @ moved)[1][:, -2:]
    flat = moved @ plane
    for turn_rad in _TURNS_RAD[_TURNS_RAD * (count - 1) >= _LEAST_BEND_RAD]:
        wheel = np.exp(1j * turn_rad * s)
        wheel = wheel - wheel.mean()
        for sense in (1j, -1j):
            z = flat[:, 0] + sense * flat[:, 1]
            turned = wheel.conj() * (wheel @ z) / (wheel @ wheel.conj()).real
            arc = np.stack([turned.real, (turned / sense).real], axis=1) @ plane.T
            distance = float(((moved - arc) ** 2).sum())
            if distance < least:
                best, least = arc, distance
    return np.asarray(center + best)
