"""Offline segmentation: which part of the task each moment of a whole motion was.

A recognizer that filters knows what came before a step; here what came after it counts as well.
Shapes: S states, T steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.task import Task

Integers = NDArray[np.int64]


class StateSegment(NamedTuple):
    """A part of a motion that is one performance of one gesteme in one state of the task."""

    state: int | None
    """Index of the state; None for unknown motion."""
    gesteme: int | None
    """Index of the gesteme; None for unknown motion."""
    start: int
    """Index of its first step."""
    stop: int
    """Index of the step after its last."""
    probability: float
    """Mean over its steps of P(state at the step | the whole motion)."""


def label_of(task: Task, segment: StateSegment) -> str | None:
    """Return the label of a segment as demonstrations have it; None for unknown motion.

    A state's name, or `state/gesteme` where the state has several gestemes.
    """
    if segment.state is None or segment.gesteme is None:
        return None
    state = task.states[segment.state]
    if len(state.gestemes) == 1:
        return state.name
    return f"{state.name}/{task.gestemes[segment.gesteme].name}"


def segments_between(
    edges: Sequence[int], states: Integers, gestemes: Integers, posterior: Array, first: int
) -> tuple[StateSegment, ...]:
    """Return the segments between edges 0 … T of a path through states.

    `states` and `gestemes` are those of each step on the path, shape (T,); `posterior` is
    P(state | the whole motion), shape (T, S); `first` is the index of the first step. A segment has
    the state of its first step and the gesteme that most of its steps have.
    """
    return tuple(
        StateSegment(
            int(states[begin]),
            int(np.bincount(gestemes[begin:end]).argmax()),
            first + begin,
            first + end,
            float(posterior[begin:end, states[begin]].mean()),
        )
        for begin, end in pairwise(edges)
    )


def edges_where(begins: NDArray[np.bool_]) -> list[int]:
    """Return the edges 0 … T, given whether a segment begins with each step but the first,
    shape (T − 1,)."""
    return [0, *(np.flatnonzero(begins) + 1).tolist(), len(begins) + 1]


def summed_by(index: Integers, values: Array, count: int) -> Array:
    """Return columns of (T, N) summed by what they are part of, shape (T, count)."""
    return np.asarray(values @ (index[:, None] == np.arange(count)))
