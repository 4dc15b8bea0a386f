"""How well recognition kept up with the truth: accuracy, delay of switches, false switches.

States are indices; `NONE` stands for a step without a label among the true states, and for a step
without a belief among the believed ones. All times are counted in steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

IntArray = NDArray[np.int64]

NONE = -1


class Scores(NamedTuple):
    """What a recognizer is worth on one performance, or on several of them pooled."""

    steps: int
    """All steps, labeled or not."""
    missing_steps: int
    """Steps without a belief."""
    labeled_steps: int
    right_steps: int
    """Labeled steps whose most probable state is the true one; a missing belief is never right."""
    switch_delays: IntArray
    """For each true switch, steps from it to the believed one; negative: early; shape (n,)."""
    missed_switches: int
    """True switches that were never believed; they stand in `switch_delays` with the length of
    the new state's whole segment."""
    false_switches: int
    """Changes of the most probable state that follow no true switch."""

    @property
    def accuracy(self) -> float:
        """Share of the labeled steps that are right; NaN where none is labeled."""
        return self.right_steps / self.labeled_steps if self.labeled_steps else float("nan")

    @property
    def false_switches_per_1000_steps(self) -> float:
        """False switches in 1000 labeled steps; NaN where none is labeled."""
        return 1000 * self.false_switches / self.labeled_steps if self.labeled_steps else np.nan

    def switch_delay(self, percent: float) -> float:
        """Return a percentile of the switch delays, steps; NaN where there was no switch."""
        return (
            float(np.percentile(self.switch_delays, percent)) if len(self.switch_delays) else np.nan
        )


def score(true_states: ArrayLike, believed_states: ArrayLike) -> Scores:
    """Score the most probable state of each step against the true one; both of shape (T,).

    A true switch is the first step of a state other than the one before it. It is believed at the
    first step, from halfway through the segment before it to the end of the segment it begins, at
    which the new state is the most probable one. Every other change of the most probable state is
    a false switch; where a belief is missing the one before it holds.
    Raises ValueError when the two are not of the same shape (T,).
    """
    true, believed = _states(true_states), _states(believed_states)
    if true.ndim != 1 or true.shape != believed.shape:
        raise ValueError(
            f"true states have shape {true.shape}, believed ones {believed.shape}: expected (T,) "
            "twice"
        )
    held = _held(believed)
    delays, followed, missed = [], set(), 0
    for before, start, end in _switches(true):
        found = np.flatnonzero(held[(before + start) // 2 : end] == true[start])
        if len(found):
            step = (before + start) // 2 + int(found[0])
            followed.add(step)
            delays.append(step - start)
        else:
            missed += 1
            delays.append(end - start)
    labeled = true != NONE
    return Scores(
        steps=len(true),
        missing_steps=int((believed == NONE).sum()),
        labeled_steps=int(labeled.sum()),
        right_steps=int((labeled & (believed == true)).sum()),
        switch_delays=np.array(delays, dtype=np.int64),
        missed_switches=missed,
        false_switches=sum(step not in followed and labeled[step] for step in changes(held)),
    )


def pooled(scores: Sequence[Scores]) -> Scores:
    """Return the scores of several performances as if they were one, without switches between."""
    return Scores(
        steps=sum(each.steps for each in scores),
        missing_steps=sum(each.missing_steps for each in scores),
        labeled_steps=sum(each.labeled_steps for each in scores),
        right_steps=sum(each.right_steps for each in scores),
        switch_delays=np.concatenate([np.zeros(0, np.int64), *(s.switch_delays for s in scores)]),
        missed_switches=sum(each.missed_switches for each in scores),
        false_switches=sum(each.false_switches for each in scores),
    )


def midway_labels(labels: ArrayLike, begin: ArrayLike, end: ArrayLike) -> IntArray:
    """Return the label of each step, shape (T,): of the sample midway between its ends.

    `labels` are those of the samples, shape (N,); `begin` and `end` the indices of the samples
    between which each step was made, shape (T,). A step across a switch so belongs to the state
    most of it was made in.
    """
    midway: IntArray = _states(labels)[(_states(begin) + _states(end)) // 2]
    return midway


def changes(states: ArrayLike) -> list[int]:
    """Return the steps at which a state is another than the one before; `NONE` is no state."""
    values = _states(states)
    steps = np.flatnonzero(values[1:] != values[:-1]) + 1
    return [int(t) for t in steps if values[t] != NONE and values[t - 1] != NONE]


def _switches(true: IntArray) -> list[tuple[int, int, int]]:
    """First step of the segment before, of the new one, and of what comes after it."""
    edges = [0, *(np.flatnonzero(true[1:] != true[:-1]) + 1).tolist(), len(true)]
    return [
        (before, start, end)
        for before, start, end in zip(edges, edges[1:], edges[2:], strict=False)
        if true[start] != NONE
    ]


def _held(believed: IntArray) -> IntArray:
    newest = np.maximum.accumulate(np.where(believed == NONE, NONE, np.arange(len(believed))))
    held: IntArray = np.where(newest == NONE, NONE, believed[newest])
    return held


def _states(states: ArrayLike) -> IntArray:
    return np.asarray(states, dtype=np.int64)
