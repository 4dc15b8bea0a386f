"""The last half minute in numbers, for the plots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

LONGEST_ROWS = 300
EVERY_S = 0.1
"""How often a row is written down."""
_ROOM = 0.08
"""Above a plot's highest tick, of its height."""
_SMALLEST, _LARGEST = 1e-3, 1e9
"""Of a plot's limits: ticks have three digits after the point, and smaller ones would read 0."""
SPAN_S = LONGEST_ROWS * EVERY_S


class Row(NamedTuple):
    """Numbers of one moment."""

    time_s: float
    numbers: Mapping[str, float]
    """By name; one that no process reported is left out."""


Rows = tuple[Row, ...]


def written(rows: Rows, now_s: float, numbers: Mapping[str, float]) -> Rows:
    """Return the newest rows, one more among them."""
    return (*rows[-LONGEST_ROWS + 1 :], Row(now_s, numbers))


def columns(rows: Rows, names: Sequence[str]) -> tuple[NDArray[np.float64], ...]:
    """Return the times, s before the newest row, and a column for each name, shapes (n,).

    What was not reported is NaN. Of no rows there is one of nothing, to have something to draw.
    """
    rows = rows or (Row(0.0, {}),)
    times = np.array([row.time_s for row in rows]) - rows[-1].time_s
    return (times, *(np.array([row.numbers.get(name, np.nan) for row in rows]) for name in names))


def limits(columns: Sequence[NDArray[np.float64]]) -> tuple[float, float]:
    """Return round limits with all numbers of some columns, and zero, between them.

    A plot cannot find them by itself where something is not a number.
    """
    values = np.concatenate([np.zeros(1), *columns])
    values = values[np.isfinite(values)]
    lower, upper = float(values.min()), float(values.max())
    rounded = -_round_up(-lower), _round_up(upper)
    return (0.0, 1.0) if rounded[0] == rounded[1] else rounded


def with_room(limits: tuple[float, float]) -> tuple[float, float]:
    """Return limits with room for the whole label of the highest tick."""
    lower, upper = limits
    return lower, upper + _ROOM * (upper - lower)


def _round_up(value: float) -> float:
    """The next of …, 0.1, 0.2, 0.5, 1, 2, 5, …; 0 for what is too small to tell from it."""
    if value < _SMALLEST:
        return 0.0
    value = min(value, _LARGEST)
    power = 10.0 ** np.floor(np.log10(value))
    return next(float(step * power) for step in (1, 2, 5, 10) if value <= step * power * (1 + 1e-9))
