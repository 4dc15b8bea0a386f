"""Recognizers by nominal directions: which one is followed, and which task state that means.

Chapter 3 of the thesis is one of them, by its settings.

Shapes: K slots (a slot is one gesteme in one task state), N directions, T steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.steps import Step
from hmcs.recognition.checking import (
    LEAST_SPREAD,
    check_distributions,
    check_shapes,
    check_within,
)
from hmcs.recognition.hmm.emissions import floored
from hmcs.recognition.model import Model, axes_of
from hmcs.recognition.recognizer import Recognition, Recognizer
from hmcs.recognition.registry import RecognizerSpec, TrainingData
from hmcs.recognition.segments import LabeledSteps, labeled_steps
from hmcs.recognition.task_chain import TaskChain, chain_of
from hmcs.task import Task
from hmcs_baselines.direction_states import (
    DirectionFilter,
    DirectionStates,
    DirectionStateSettings,
    check_direction_states,
    learn_directions,
    thesis_settings,
)
from hmcs_baselines.estimators import EstimatorSettings
from hmcs_baselines.slots import (
    SlotChain,
    SlotFilter,
    check_slot_chain,
    learn_slot_chain,
    slot_index,
)


class DirectionTaskSettings(NamedTuple):
    """How directions and what they mean in the task are learned."""

    directions: DirectionStateSettings = DirectionStateSettings(discovery="recurring-chords")
    """Of the directions. A task's demonstrations need not all follow one order."""
    least_share: float = 0.01
    """In any task state every direction is at least this probable, or half an even share."""
    any_state: float = 1e-3
    """In each step the task goes to any state whatever with this probability, so that orders never
    trained stay possible."""


class DirectionTask(NamedTuple):
    """Directions, and a task recognized by them."""

    directions: DirectionStates
    chain: SlotChain
    shares: Array
    """P(direction | slot), shape (K, N)."""


class DirectionRecognizer:
    """Filtered probabilities of directions below, of the task's states above."""

    def __init__(self, model: Model, *, anywhere: bool = False) -> None:
        """Begin as the task does or, with `anywhere`, in any state."""
        known: DirectionTask = model.knowledge
        self._axes = list(model.axes)
        self._shares = known.shares
        self._directions = DirectionFilter(known.directions, anywhere=anywhere)
        self._filter = SlotFilter(chain_of(model.task), known.chain, anywhere=anywhere)

    def step(self, step: Step) -> Recognition:
        """Take the next step; steps come in order, without gaps."""
        directions = self._directions.step(step.displacement[self._axes])
        return self._filter.step(step.index, np.log(self._shares @ directions))


def _learn(data: TrainingData) -> DirectionTask:
    settings: DirectionTaskSettings = data.settings
    chain, axes = chain_of(data.task), list(axes_of(data.task))
    labeled = [labeled_steps(data.task, each) for each in data.demonstrations]
    moved = [np.array([step.displacement[axes] for step in each.steps]) for each in labeled]
    directions = learn_directions(
        moved, settings.directions, data.rng, [each.gestemes for each in labeled]
    )
    data.progress(f"{len(directions.initial)} directions found")
    believed = [_filtered(directions, own) for own in moved]
    return DirectionTask(
        directions,
        learn_slot_chain(chain, data.segments, settings.any_state),
        direction_shares(chain, labeled, believed, settings.least_share),
    )


def direction_shares(
    chain: TaskChain, labeled: Sequence[LabeledSteps], believed: Sequence[Array], least: float
) -> Array:
    """Return P(direction | slot), (K, N), counted in P(direction) at labeled steps, (T, N) each.

    A slot without a labeled step has the directions of its gesteme, or all alike.
    """
    index, count = slot_index(chain), believed[0].shape[1]
    counts = np.zeros((len(chain.slot_state), count))
    for each, beliefs in zip(labeled, believed, strict=True):
        for state, gesteme, belief in zip(each.states, each.gestemes, beliefs, strict=True):
            if state >= 0:
                counts[index[int(state), int(gesteme)]] += belief
    for slot in np.flatnonzero(counts.sum(axis=1) == 0):
        counts[slot] = counts[chain.slot_gesteme == chain.slot_gesteme[slot]].sum(axis=0)
    counts[counts.sum(axis=1) == 0] = 1.0
    shares = counts / counts.sum(axis=1, keepdims=True)
    return floored(shares, min(least, 0.5 / count))


def _filtered(directions: DirectionStates, moved: Array) -> Array:
    follow = DirectionFilter(directions)
    return np.array([follow.step(displacement) for displacement in moved])


def _recognizer(model: Model, anywhere: bool) -> Recognizer:
    return DirectionRecognizer(model, anywhere=anywhere)


def _check(known: DirectionTask, task: Task) -> None:
    slots = len(chain_of(task).slot_state)
    check_direction_states(known.directions, len(axes_of(task)))
    check_slot_chain(known.chain, slots)
    check_shapes(known._asdict(), {"shares": (slots, len(known.directions.initial))})
    check_within("shares", known.shares, LEAST_SPREAD, 1.0)
    check_distributions("shares", known.shares)


KIND = RecognizerSpec(
    name="directions",
    summary="nominal directions by the best chords, a Gaussian about each, and a counted chain",
    source="HMCS, after Aarno 2007, chapter 3",
    settings=DirectionTaskSettings,
    knowledge=DirectionTask,
    learn=_learn,
    recognizer=_recognizer,
    check=_check,
)
CHAPTER_3 = KIND._replace(
    name="chapter-3",
    summary="k-means and its elbow, support vectors with a sigmoid, a fully connected HMM",
    source="Aarno 2007, 3.1: (3.1)-(3.5), with its own settings",
    settings=partial(DirectionTaskSettings, directions=thesis_settings()),
)
DIRECTIONS_SVM = KIND._replace(
    name="directions-svm",
    summary="as `directions`, with support vectors in place of the Gaussians",
    settings=partial(
        DirectionTaskSettings,
        directions=DirectionStateSettings(
            discovery="recurring-chords", estimator=EstimatorSettings(kind="svm")
        ),
    ),
)
