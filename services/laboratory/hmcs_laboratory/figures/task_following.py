"""Performances of a task as the layered HMM and the segment filter follow them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.recognition.model import Model
from hmcs.recognition.registry import recognizer_of
from hmcs_baselines.classifying import GestemeHmmClassifier
from hmcs_baselines.two_levels import TwoLevels
from hmcs_laboratory.data.tasks import Performance, TaskSet

Integers = NDArray[np.int64]


class Followed(NamedTuple):
    """What the layered HMM made of a performance, restart given."""

    log_alpha: Array
    """log P(all steps so far, state), nats, shape (T, S)."""
    states: Array
    """P(state | all steps so far), shape (T, S)."""
    winners: Integers
    """The most probable gesteme since the restart, shape (T,)."""
    margin_of_gestemes: float
    """Mean difference of the two most probable gestemes."""

    @property
    def falls(self) -> Array:
        """By how much the total likelihood falls with each step, nats, shape (T,)."""
        total = np.logaddexp.reduce(self.log_alpha, axis=1)
        return np.asarray(-np.diff(total, prepend=0.0))


class Believed(NamedTuple):
    """What the segment filter made of it, no marks given."""

    states: Array
    """Shape (T, S)."""
    unknown: Array
    """Shape (T,)."""


class Names(NamedTuple):
    """The states and gestemes of a task, in its order."""

    states: tuple[str, ...]
    gestemes: tuple[str, ...]
    of_state: Integers
    """Index of the gesteme of each state."""


def names_of(data: TaskSet) -> Names:
    """Return the names of the states and gestemes of a task."""
    return Names(
        tuple(state.name for state in data.task.states),
        tuple(gesteme.name for gesteme in data.task.gestemes),
        data.gesteme_of_state,
    )


def follow(model: Model, performance: Performance) -> Followed:
    """Follow a performance by a layered HMM that is restarted at its true changes."""
    knowledge: TwoLevels = model.knowledge
    recognizer = recognizer_of(model)
    gestemes = GestemeHmmClassifier(
        knowledge.gestemes, model.axes, knowledge.restart, knowledge.cusum
    )
    beliefs = [recognizer.step(step).belief for step in performance.steps]
    classified = np.array([gestemes.step(step).gestemes for step in performance.steps])
    states = np.array([belief.states for belief in beliefs])
    total = np.cumsum([belief.log_likelihood for belief in beliefs])
    with np.errstate(divide="ignore"):
        log_alpha = total[:, None] + np.log(states)
    return Followed(log_alpha, states, classified.argmax(axis=1), margin_of(classified))


def believe(model: Model, performance: Performance) -> Believed:
    """Follow a performance by the segment filter, without its marks."""
    recognizer = recognizer_of(model)
    beliefs = [recognizer.step(step).belief for step in performance.unmarked().steps]
    return Believed(
        np.array([belief.states for belief in beliefs]),
        np.array([belief.unknown for belief in beliefs]),
    )


def margin_of(rows: Array) -> float:
    """Return the mean difference between the largest and the next of each row."""
    ordered = np.sort(rows, axis=1)
    return float((ordered[:, -1] - ordered[:, -2]).mean())
