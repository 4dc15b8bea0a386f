"""Methods that classify a whole gesteme, or the part of it that was seen."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hmcs.arrays import Array
from hmcs_laboratory.data.gestemes import GestemeSet

Examples = Sequence[Sequence[Array]]
"""Of each of G gestemes performances to learn from: positions, m, shape (T, D)."""


class TooFewError(ValueError):
    """Fewer examples than the method can learn from."""


class Fitted(Protocol):
    """A method that has learned."""

    def classify(self, positions: Array, *, complete: bool) -> Array:
        """Return a score of each gesteme, shape (G,), for positions, m, shape (T, D), T > 2.

        The highest is the most probable one. `complete` tells whether they are the whole gesteme
        or its beginning; a method need not make use of it.
        """
        ...


@dataclass(frozen=True)
class WholeMethod:
    """A method under the name by which studies list it."""

    name: str
    source: str
    """Library and class, or paper."""
    fit: Callable[[Examples, np.random.Generator], Fitted]
    """Raises UserError where its library is not installed, and TooFewError."""
    prepare: Callable[[Examples], None] = lambda _: None
    """Has what the library imports or compiles on first use done, so that it is not timed."""
    whole_only: bool = False
    """Whether it compares whole motions only. To classify beginnings it learns from beginnings of
    the same share: it is given how much it sees, others are not."""
    library: str = ""
    """Of a peer, which is not installed with the laboratory; empty where none is needed."""


def measured_on(
    method: WholeMethod,
    data: GestemeSet,
    rng: np.random.Generator,
    seen: Sequence[float] = (1.0,),
) -> list[dict[str, float]]:
    """Return `accuracy`, `us_per_sample` and `fit_s` of a method for each share seen.

    It classifies of each performance that share of the samples, from the start. A method that
    cannot learn from so few has NaN throughout. Times are processor times of one thread.
    """
    method.prepare(data.training)
    # Of its own for learning: learning once or several times is the same.
    seed = int(rng.integers(2**32))
    learned: dict[float, tuple[Fitted, float]] = {}
    measures = []
    for share in seen:
        part = share if method.whole_only else 1.0
        try:
            if part not in learned:
                learned[part] = _timed_fit(method, data.training, part, seed)
        except TooFewError:
            measures.append(dict.fromkeys(("accuracy", "us_per_sample", "fit_s"), np.nan))
            continue
        fitted, fit_s = learned[part]
        measures.append({**_classified(fitted, data.test, share), "fit_s": fit_s})
    return measures


def beginning(positions: Array, share: float) -> Array:
    """Return that share of the positions from the start, three of them at least."""
    return positions[: max(3, int(np.ceil(share * len(positions))))]


def _timed_fit(
    method: WholeMethod, training: Examples, share: float, seed: int
) -> tuple[Fitted, float]:
    examples = [[beginning(positions, share) for positions in own] for own in training]
    began_s = time.thread_time()
    fitted = method.fit(examples, np.random.default_rng(seed))
    return fitted, time.thread_time() - began_s


def _classified(fitted: Fitted, test: Examples, seen: float) -> dict[str, float]:
    right = count = samples = 0
    spent_s = 0.0
    for gesteme, own in enumerate(test):
        for positions in own:
            part = beginning(positions, seen)
            began_s = time.thread_time()
            scores = fitted.classify(part, complete=seen >= 1)
            spent_s += time.thread_time() - began_s
            samples += len(part)
            count += 1
            right += int(np.argmax(scores)) == gesteme
    return {"accuracy": right / count, "us_per_sample": 1e6 * spent_s / samples}
