"""How well a segmentation agrees with the truth, whatever names the parts have been given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Integers = NDArray[np.int64]


class BoundaryAgreement(NamedTuple):
    """Boundaries found against true ones; several demonstrations may be added up."""

    matched: int
    """Pairs of a found and a true boundary no farther apart than the tolerance, each in one."""
    found: int
    true: int

    @property
    def precision(self) -> float:
        """Share of the boundaries found that are true; 1 where none was found."""
        return self.matched / self.found if self.found else 1.0

    @property
    def recall(self) -> float:
        """Share of the true boundaries that were found; 1 where there is none."""
        return self.matched / self.true if self.true else 1.0

    @property
    def f_score(self) -> float:
        """Harmonic mean of precision and recall; 1 where there is nothing to find nor found."""
        either = self.found + self.true
        return 2 * self.matched / either if either else 1.0


def adjusted_rand_index(true: ArrayLike, found: ArrayLike) -> float:
    """Return how well two labelings of the same steps agree, both of shape (T,).

    1 where they are the same but for the names, 0 on average where they have nothing to do with
    one another (Hubert and Arabie 1985). Labels are compared with `==` only.
    Raises ValueError when the two are not of the same shape (T,), or T is 0.
    """
    first, second = np.asarray(true), np.asarray(found)
    if first.ndim != 1 or first.shape != second.shape or not len(first):
        raise ValueError(
            f"labels have shapes {first.shape} and {second.shape}: expected (T,) twice, T > 0"
        )
    rows = np.unique(first, return_inverse=True)[1]
    columns = np.unique(second, return_inverse=True)[1]
    width = int(columns.max()) + 1
    together = _pairs(np.bincount(rows * width + columns))
    in_first, in_second = _pairs(np.bincount(rows)), _pairs(np.bincount(columns))
    expected = in_first * in_second / max(_pairs(np.array([len(first)])), 1.0)
    most = (in_first + in_second) / 2
    # Both are one cluster, or both nothing but clusters of one step: the same labeling.
    if most == expected:
        return 1.0
    return (together - expected) / (most - expected)


def boundaries_of(labels: ArrayLike) -> Integers:
    """Return the indices at which a label is another than the one before; labels (T,)."""
    values = np.asarray(labels)
    return np.flatnonzero(values[1:] != values[:-1]) + 1


def boundary_agreement(true: ArrayLike, found: ArrayLike, tolerance: float) -> BoundaryAgreement:
    """Match boundaries one to one, as many as can be within the tolerance.

    `true` and `found` are indices of steps, shapes (m,) and (n,), in any order; a found boundary
    is matched by one that is at most `tolerance` steps away.
    Raises ValueError for a tolerance below 0.
    """
    if not tolerance >= 0:
        raise ValueError(f"tolerance is {tolerance}, expected 0 steps or more")
    expected, given = np.sort(np.asarray(true, float)), np.sort(np.asarray(found, float))
    matched = at = 0
    # Intervals of equal width in rising order: the earliest that fits leaves most to the others.
    for boundary in expected:
        while at < len(given) and given[at] < boundary - tolerance:
            at += 1
        if at < len(given) and given[at] <= boundary + tolerance:
            matched += 1
            at += 1
    return BoundaryAgreement(matched, len(given), len(expected))


def pooled_agreement(agreements: Sequence[BoundaryAgreement]) -> BoundaryAgreement:
    """Return the boundaries of several demonstrations as if they were one's."""
    return BoundaryAgreement(
        sum(each.matched for each in agreements),
        sum(each.found for each in agreements),
        sum(each.true for each in agreements),
    )


def _pairs(counts: NDArray[np.integer]) -> float:
    sizes = counts.astype(float)
    return float((sizes * (sizes - 1)).sum() / 2)
