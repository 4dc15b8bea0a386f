"""What numbers of a model file must be before anything is computed with them.

A file that says the right words may still hold any numbers: a kind of recognizer checks its
knowledge with these. All raise ValueError naming the field, what it is and what was expected.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

LARGEST = 1e15
"""No position, m, force, N, likelihood, nats, or count of a model is larger; squares of such
numbers are still far from overflow."""
LEAST_SPREAD = 1e-30
"""Variances and scales are not smaller: what is divided by them stays finite."""
_SUM_TOLERANCE = 1e-6

AnyArray = NDArray[Any]


def check_shapes(
    arrays: Mapping[str, AnyArray], shapes: Mapping[str, tuple[int, ...]], kind: Any = np.float64
) -> None:
    """Refuse an array of another shape or type than expected, by name."""
    for name, shape in shapes.items():
        array = arrays[name]
        if array.shape != shape or array.dtype != kind:
            raise ValueError(
                f"array {name!r} is {array.dtype} of shape {array.shape}, expected "
                f"{np.dtype(kind)} of shape {shape}"
            )


def check_within(name: str, values: AnyArray | float, least: float, most: float) -> None:
    """Refuse a number or an array with an entry outside least … most, or that is no number."""
    array = np.asarray(values)
    outside = ~((array >= least) & (array <= most))
    if outside.any():
        wanted = "above zero" if least == LEAST_SPREAD else f"{least:g} or more"
        raise ValueError(
            f"{name!r} holds {array[outside].flat[0]:g}, expected {wanted}, and {most:g} at most"
        )


def check_spreads(name: str, values: AnyArray | float) -> None:
    """Refuse variances, standard deviations, scales or widths that nothing can be divided by."""
    check_within(name, values, LEAST_SPREAD, LARGEST)


def check_distributions(name: str, rows: AnyArray) -> None:
    """Refuse rows, the last axis, that are no probabilities with the sum one."""
    sums = rows.sum(axis=-1)
    if not (rows >= 0).all() or not (np.abs(sums - 1.0) <= _SUM_TOLERANCE).all():
        raise ValueError(f"array {name!r} does not hold probabilities that sum to one")


def check_leaving(name: str, rows: AnyArray) -> None:
    """Refuse rows, the last axis, that are no probabilities with a sum of one at most."""
    if not (rows >= 0).all() or not (rows.sum(axis=-1) <= 1.0 + _SUM_TOLERANCE).all():
        raise ValueError(f"array {name!r} does not hold probabilities that sum to one at most")


def check_choice(name: str, value: str, choices: Collection[str]) -> None:
    """Refuse a name that is none of the choices."""
    if value not in choices:
        raise ValueError(f"{name} is {value!r}, expected one of {', '.join(choices)}")
