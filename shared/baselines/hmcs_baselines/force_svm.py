"""Castellani's hybrid: support vectors tell categories of force apart, an HMM the sub-tasks.

Several sub-tasks may share a category; here categories are the gestemes of a task. Where not all
demonstrations carry a force, categories are distinguished by the direction of motion instead.
Shapes: M categories, K slots (a slot is one gesteme in one task state), F components, T steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.steps import Step
from hmcs.recognition.checking import LARGEST, check_shapes, check_spreads, check_within
from hmcs.recognition.model import Model, axes_of
from hmcs.recognition.recognizer import Recognition, Recognizer
from hmcs.recognition.registry import RecognizerSpec, TrainingData
from hmcs.recognition.segmentation import StateSegment
from hmcs.recognition.segments import LearningError
from hmcs.recognition.step_features import step_features
from hmcs.recognition.task_chain import chain_of
from hmcs.task import Task
from hmcs_baselines.estimators import (
    Estimator,
    EstimatorSettings,
    check_estimator,
    class_means,
    learn_estimator,
    likelihoods,
)
from hmcs_baselines.slots import (
    SlotChain,
    SlotFilter,
    check_slot_chain,
    learn_slot_chain,
    most_probable_segments,
)
from hmcs_baselines.svm import SvmSettings

Integers = NDArray[np.int64]


class Components(NamedTuple):
    """Which components of the operator's wrench are looked at."""

    force_x: bool = True
    force_y: bool = True
    force_z: bool = True
    torque_x: bool = True
    torque_y: bool = True
    torque_z: bool = True


class ForceSettings(NamedTuple):
    """How the hybrid is learned."""

    components: Components = Components()
    """The paper looks at one."""
    estimator: EstimatorSettings = EstimatorSettings(
        kind="svm", least_ratio=0.01, svm=SvmSettings(1.0, 10.0, 2.0)
    )
    """What tells categories apart; components are standardized before it."""
    any_state: float = 1e-3
    """In each step the task goes to any state whatever with this probability, so that orders never
    trained stay possible."""


class ForceTask(NamedTuple):
    """What the hybrid knows."""

    observed: Literal["wrench", "direction"]
    """What categories are distinguished by: `direction` where a demonstration had no wrench."""
    components: tuple[int, ...]
    """Indices of the components looked at, of the wrench or of the position."""
    center: Array
    """Mean of each component, shape (F,)."""
    scale: Array
    """Standard deviation of each component, 1 for one that never varied, shape (F,)."""
    estimator: Estimator
    """Tells the categories apart, standardized components given."""
    chain: SlotChain


class ForceRecognizer:
    """The filtered probabilities of the task's states."""

    def __init__(self, model: Model, *, anywhere: bool = False) -> None:
        """Begin as the task does or, with `anywhere`, in any state."""
        self._known: ForceTask = model.knowledge
        self._chain = chain_of(model.task)
        self._filter = SlotFilter(self._chain, self._known.chain, anywhere=anywhere)

    def step(self, step: Step) -> Recognition:
        """Take the next step; one without the wrench that was learned from tells nothing."""
        categories = category_likelihoods(self._known, [step])[0]
        return self._filter.step(step.index, np.log(categories)[self._chain.slot_gesteme])


def segment(model: Model, steps: Sequence[Step], anywhere: bool) -> tuple[StateSegment, ...]:
    """Return the segments of a whole motion, one step at least, by Viterbi."""
    known, chain = model.knowledge, chain_of(model.task)
    log_emission = np.log(category_likelihoods(known, steps))[:, chain.slot_gesteme]
    return most_probable_segments(
        chain, known.chain, log_emission, steps[0].index, anywhere=anywhere
    )


def category_likelihoods(known: ForceTask, steps: Sequence[Step]) -> Array:
    """Return P(step | category), shape (T, M), up to a factor for each step: rows sum to one.

    A step without the wrench that was learned from is as likely in all categories.
    """
    rows = _rows(steps, known.observed, known.components)
    unfelt = np.isnan(rows).any(axis=1, keepdims=True)
    standard = (np.where(unfelt, 0.0, rows) - known.center) / known.scale
    probabilities = likelihoods(known.estimator, standard)
    return np.where(unfelt, 1.0 / probabilities.shape[1], probabilities)


def _rows(
    steps: Sequence[Step], observed: Literal["wrench", "direction"], components: Sequence[int]
) -> Array:
    """What is observed in each step, shape (T, F), NaN where it was not felt."""
    if observed == "direction":
        return step_features(steps, ("direction",), components)
    return step_features(steps, ("force", "torque"), ())[:, list(components)]


def _learn(data: TrainingData) -> ForceTask:
    settings: ForceSettings = data.settings
    chain = chain_of(data.task)
    observed: Literal["wrench", "direction"] = "wrench"
    components = tuple(int(k) for k in np.flatnonzero(settings.components))
    if any(step.wrench is None for each in data.segments for step in each.steps):
        data.progress("not all demonstrations carry a force: directions of motion are used")
        observed, components = "direction", axes_of(data.task)
    if not components:
        raise LearningError("no component of the wrench is looked at: switch one on")
    rows = [_rows(each.steps, observed, components) for each in data.segments]
    categories = np.repeat([s.gesteme for s in data.segments], [len(own) for own in rows])
    stacked = np.concatenate(rows)
    scale = stacked.std(axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    center = stacked.mean(axis=0)
    standard = (stacked - center) / scale
    return ForceTask(
        observed,
        components,
        center,
        scale,
        learn_estimator(
            standard,
            categories,
            class_means(standard, categories, len(data.task.gestemes)),
            settings.estimator,
        ),
        learn_slot_chain(chain, data.segments, settings.any_state),
    )


def _recognizer(model: Model, anywhere: bool) -> Recognizer:
    return ForceRecognizer(model, anywhere=anywhere)


def _check(known: ForceTask, task: Task) -> None:
    count = len(known.components)
    axes = 6 if known.observed == "wrench" else 3
    check_within("number of components", count, 1, axes)
    check_within("components", np.array(known.components), 0, axes - 1)
    check_shapes(known._asdict(), {"center": (count,), "scale": (count,)})
    check_within("center", known.center, -LARGEST, LARGEST)
    check_spreads("scale", known.scale)
    check_slot_chain(known.chain, len(chain_of(task).slot_state))
    check_estimator(known.estimator, len(task.gestemes), count)


KIND = RecognizerSpec(
    name="force-svm",
    summary="support vectors on force for each category of sub-task, an HMM of sub-tasks above",
    source="Castellani et al. 2004; thesis 2.3",
    settings=ForceSettings,
    knowledge=ForceTask,
    learn=_learn,
    recognizer=_recognizer,
    check=_check,
    segment=segment,
)
