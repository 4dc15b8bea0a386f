"""Rows of a study: means over its trials, with 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from hmcs_laboratory.study import Measured

Row = dict[str, str | int | float | None]
"""A method at a setting; None where nothing could be measured."""

CI95 = "_ci95"
"""Ending of the name under which the half width of a measure's interval stands."""


def mean_ci95(values: ArrayLike) -> tuple[float | None, float | None]:
    """Return the mean of independent values and the half width of its 95 % interval.

    By Student's t; NaN among the values is left out. None where no value, or for the half width
    fewer than two, are left.
    """
    sample = np.asarray(values, dtype=float)
    sample = sample[~np.isnan(sample)]
    if not len(sample):
        return None, None
    mean = float(sample.mean())
    if len(sample) < 2:
        return mean, None
    standard_error = float(sample.std(ddof=1)) / np.sqrt(len(sample))
    return mean, float(stdtrit(len(sample) - 1, 0.975) * standard_error)


def rows_of(trials: Sequence[Sequence[Measured]]) -> list[Row]:
    """Return a row for each method at each setting, in the order they were first measured.

    Raises ValueError when a setting and a measure have the same name.
    """
    groups: dict[tuple[object, ...], list[Measured]] = {}
    for trial in trials:
        for measured in trial:
            key = (measured.method, *measured.setting.items())
            groups.setdefault(key, []).append(measured)
    return [_row(group) for group in groups.values()]


def _row(group: Sequence[Measured]) -> Row:
    row: Row = {"method": group[0].method, **group[0].setting}
    for name in dict.fromkeys(name for measured in group for name in measured.measures):
        if name in row:
            raise ValueError(f"{name!r} is a setting and a measure")
        values = [measured.measures.get(name, np.nan) for measured in group]
        row[name], row[name + CI95] = mean_ci95(values)
    return row
