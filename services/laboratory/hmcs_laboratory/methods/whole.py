"""Methods that classify a whole gesteme, or the part of it that was seen."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hmcs_laboratory.data.gestemes import GestemeSet

Array = NDArray[np.float64]
Examples = Sequence[Sequence[Array]]
"""Of each of G gestemes performances to learn from: positions, m, shape (T, D)."""


class Fitted(Protocol):
    """A method that has learned."""

    def classify(self, positions: Array) -> Array:
        """Return a score of each gesteme, shape (G,), for positions, m, shape (T, D), T > 2.

        The highest is the most probable one.
        """
        ...


@dataclass(frozen=True)
class WholeMethod:
    """A method under the name by which studies list it."""

    name: str
    source: str
    """Library and class, or paper."""
    fit: Callable[[Examples, np.random.Generator], Fitted]
    """Raises UserError where its library is not installed."""


def timed_fit(
    method: WholeMethod, examples: Examples, rng: np.random.Generator
) -> tuple[Fitted, float]:
    """Return the method fitted, and the processor time it took, s, of the one thread it has."""
    began_s = time.thread_time()
    fitted = method.fit(examples, rng)
    return fitted, time.thread_time() - began_s


def classified(
    fitted: Fitted, test: Examples, seen: float = 1.0
) -> tuple[dict[str, float], NDArray[np.int64]]:
    """Classify every performance, of each the share `seen` from its start.

    Returns `accuracy` and `us_per_sample`, and how often each gesteme, in rows, was taken for
    which, in columns, shape (G, G).
    """
    confusion = np.zeros((len(test), len(test)), dtype=np.int64)
    samples, spent_s = 0, 0.0
    for gesteme, own in enumerate(test):
        for positions in own:
            part = positions[: max(3, int(np.ceil(seen * len(positions))))]
            began_s = time.thread_time()
            scores = fitted.classify(part)
            spent_s += time.thread_time() - began_s
            samples += len(part)
            confusion[gesteme, int(np.argmax(scores))] += 1
    measures = {
        "accuracy": float(confusion.trace() / confusion.sum()),
        "us_per_sample": 1e6 * spent_s / samples,
    }
    return measures, confusion


def measured_on(
    method: WholeMethod, data: GestemeSet, rng: np.random.Generator, seen: float = 1.0
) -> dict[str, float]:
    """Return `accuracy`, `fit_s` and `us_per_sample` of a method on a set of gestemes."""
    fitted, fit_s = timed_fit(method, data.training, rng)
    measures, _ = classified(fitted, data.test, seen)
    return {**measures, "fit_s": fit_s}
