"""Sets of random gestemes, each performed several times (4.2.1).

Each sample that the simulated hand makes is a step.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.operators import Operator
from hmcs.motion.references import References, random_gestemes
from hmcs_laboratory.data.hands import moved


class GestemeSet(NamedTuple):
    """Performances of G gestemes; of each positions, m, shape (T, D)."""

    training: tuple[tuple[Array, ...], ...]
    """Of each gesteme those to learn from."""
    test: tuple[tuple[Array, ...], ...]
    """Of each gesteme those to recognize."""

    def first(self, *, gestemes: int | None = None, training: int | None = None) -> GestemeSet:
        """Return the set of the first gestemes only, and the first performances to learn from."""
        return GestemeSet(
            tuple(own[:training] for own in self.training[:gestemes]), self.test[:gestemes]
        )


def random_references(
    references: References, count: int, rng: np.random.Generator
) -> tuple[Array, ...]:
    """Return the curves of random gestemes, m, shape (K, D)."""
    drawn = random_gestemes(references, count, rng)
    return tuple(points[:, : references.dimensions] for points in drawn)


def performed(
    references: Sequence[Array],
    operator: Operator,
    *,
    training: int,
    test: int,
    rng: np.random.Generator,
) -> GestemeSet:
    """Return performances of gestemes, so many of each to learn from and to recognize."""
    made = []
    # A stream a gesteme: the first gestemes of a larger set are performed as in a smaller one.
    for reference, stream in zip(references, rng.spawn(len(references)), strict=True):
        made.append([moved(reference, operator, stream).positions for _ in range(training + test)])
    return GestemeSet(
        tuple(tuple(own[test:]) for own in made), tuple(tuple(own[:test]) for own in made)
    )
