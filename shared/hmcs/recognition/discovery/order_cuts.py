"""Cutting demonstrations of one order into pieces, all at the same places."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.discovery.consensus import Consensus, between, consensus
from hmcs.recognition.discovery.curve_pieces import Stretches, cut, fitted, parameters, stretches_of
from hmcs.recognition.discovery.stops import stops
from hmcs.recognition.discovery.unlabeled_demos import ResampledDemo, rising

Integers = NDArray[np.int64]

_WINDOW_STEPS = 12
"""Where one demonstration is all there is, its noise is what a line or an arc leaves of so many
steps..."""
_CORRELATION = 0.8
"""...and its deviation from one step to the next as correlated as a hand's usually is."""


class CutSettings(NamedTuple):
    """The choices of cutting."""

    shortest_steps: int = 4
    """No piece is shorter."""
    penalty: float = 0.35
    """Of a piece, as a share of the Bayesian information criterion."""
    roughness_steps: float = 0.15
    """A mean is never believed to be nearer to the true curve than this."""
    stops: bool = True
    """Whether stops, where there are any, are the boundaries, and not the shape."""
    stop_ratio: float = 2.7
    """A stop is a step that takes so many times the median one."""
    support: float = 0.5
    """A boundary shows in at least this share of the demonstrations."""


class OrderCut(NamedTuple):
    """Demonstrations of one order, cut into K pieces each."""

    pieces: tuple[Array, ...]
    """Each piece of the demonstrations' mean, m, shape (·, 3), K of them."""
    performed: tuple[tuple[Array, ...], ...]
    """For each demonstration its own pieces, K of them."""
    at: tuple[Array, ...]
    """For each demonstration the points at which pieces begin: indices with fractions, rising,
    shape (K − 1,)."""
    support: Array
    """Share of the demonstrations that show each boundary, shape (K − 1,)."""
    stopped: bool
    """Whether the boundaries are stops."""


def cut_order(
    demonstrations: Sequence[ResampledDemo], step_m: float, settings: CutSettings
) -> OrderCut:
    """Cut demonstrations of the same order, the first in their middle.

    Where they stop is where they are cut; where they never stop, it is where the best lines and
    arcs through their mean meet.
    """
    mean = consensus([each.points for each in demonstrations], step_m)
    dwell = [each.dwell for each in demonstrations if each.dwell is not None]
    if settings.stops and len(dwell) == len(demonstrations):
        found = stops(
            mean,
            dwell,
            ratio=settings.stop_ratio,
            support=settings.support,
            margin_steps=settings.shortest_steps,
        )
        if found:
            knots = np.array([0, *(stop.point for stop in found), len(mean.path) - 1])
            at = tuple(np.array(own) for own in zip(*(stop.at for stop in found), strict=True))
            support = np.array([stop.support for stop in found])
            return _order_cut(demonstrations, mean, knots, at, support, True)
    knots, support = _knots(demonstrations, mean, step_m, settings)
    at = tuple(own[knots[1:-1]] for own in mean.at)
    return _order_cut(demonstrations, mean, knots, at, support, False)


def _order_cut(
    demonstrations: Sequence[ResampledDemo],
    mean: Consensus,
    knots: Integers,
    at: tuple[Array, ...],
    support: Array,
    stopped: bool,
) -> OrderCut:
    performed = []
    for each, own in zip(demonstrations, at, strict=True):
        last = len(each.points) - 1
        ends = np.array([0, *rising(own, last), last])
        performed.append(_between_knots(each.points, ends))
    return OrderCut(_between_knots(mean.path, knots), tuple(performed), at, support, stopped)


def _between_knots(points: Array, knots: Integers) -> tuple[Array, ...]:
    return tuple(points[begin : end + 1] for begin, end in pairwise(knots.tolist()))


def _knots(
    demonstrations: Sequence[ResampledDemo], mean: Consensus, step_m: float, settings: CutSettings
) -> tuple[Integers, Array]:
    """Knots of the mean by shape, and the share of demonstrations that show each."""
    stretches = stretches_of(mean.path, settings.shortest_steps)
    roughness = (settings.roughness_steps * step_m) ** 2
    count = len(demonstrations)
    if count == 1:
        variance, correlation = _variance_alone(stretches), _CORRELATION
    else:
        variance, correlation = mean.variance, mean.correlation
    # Neighboring points err together: so many of them count as one.
    together = (1 + correlation) / (1 - correlation)
    knots = cut(stretches, (variance / count + roughness) * together, settings.penalty)
    if count == 1:
        return knots, np.ones(len(knots) - 2)
    least = (variance + roughness) * together * parameters(stretches.axes)[0]
    aligned = [between(each.points, at) for each, at in zip(demonstrations, mean.at, strict=True)]
    while True:
        support = np.array(
            [
                np.mean([_breaks(own, knots[k - 1 : k + 2], least) for own in aligned])
                for k in range(1, len(knots) - 1)
            ]
        )
        if not len(support) or support.min() >= settings.support:
            return knots, support
        knots = np.delete(knots, 1 + support.argmin())


def _breaks(points: Array, knots: Integers, least: float) -> bool:
    """Whether a boundary explains more of one demonstration than its noise would."""
    begin, middle, end = (int(knot) for knot in knots)
    apart = _residual(points[begin : middle + 1]) + _residual(points[middle : end + 1])
    return _residual(points[begin : end + 1]) - apart > least


def _residual(points: Array) -> float:
    return float(((points - fitted(points)) ** 2).sum())


def _variance_alone(stretches: Stretches) -> float:
    """Variance of a point along one axis across the path, from short windows."""
    length = stretches.last - stretches.first
    window = length == min(_WINDOW_STEPS, int(length.max()))
    left = np.minimum(stretches.line, stretches.arc)[window]
    points = int(length[window][0]) + 1
    freedom = max(points * stretches.axes - parameters(stretches.axes)[1], 1)
    return float(np.median(left)) / freedom
