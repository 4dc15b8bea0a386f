"""A figure, its goal, and how both are printed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np


class Figure(NamedTuple):
    """One measured number."""

    name: str
    value: float
    unit: str = ""
    at_most: float | None = None
    at_least: float | None = None

    @property
    def reached(self) -> bool:
        """Whether it is within its goal; a figure without one always is."""
        return (self.at_most is None or self.value <= self.at_most) and (
            self.at_least is None or self.value >= self.at_least
        )

    def __str__(self) -> str:
        goal = "".join(
            f"  goal {sign} {bound:g}"
            for sign, bound in (("≤", self.at_most), ("≥", self.at_least))
            if bound is not None
        )
        mark = (
            ""
            if self.at_most is None and self.at_least is None
            else "  " + ("reached" if self.reached else "MISSED")
        )
        return f"{self.name:<58} {self.value:10.4g} {self.unit:<6}{goal}{mark}"


def tell(title: str, figures: Iterable[Figure]) -> bool:
    """Print figures under a title; return whether all have reached their goals."""
    figures = list(figures)
    print(f"\n{title}")
    for figure in figures:
        print(f"  {figure}")
    return all(figure.reached for figure in figures)


def percentile_ms(durations_ns: Sequence[int], percent: float) -> float:
    """Return a percentile of durations given in ns, ms."""
    return float(np.percentile(durations_ns, percent)) * 1e-6
