"""Hannaford & Lee's task HMM: a state for each mental stage, Gaussian sensors, dwell times (2.33).

Shapes: K slots (a slot is one gesteme in one task state), F dimensions, T steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.steps import Step
from hmcs.recognition.checking import (
    LARGEST,
    check_choice,
    check_shapes,
    check_spreads,
    check_within,
)
from hmcs.recognition.hmm.emissions import log_gaussians
from hmcs.recognition.model import Model, axes_of
from hmcs.recognition.recognizer import Recognition, Recognizer
from hmcs.recognition.registry import RecognizerSpec, TrainingData
from hmcs.recognition.segmentation import StateSegment
from hmcs.recognition.segments import LearningError
from hmcs.recognition.step_features import (
    Sensors,
    StepFeatureReader,
    available_sensors,
    sensor_dimensions,
    step_features,
)
from hmcs.recognition.task_chain import chain_of
from hmcs.task import Task
from hmcs_baselines.slots import (
    SlotChain,
    SlotFilter,
    check_slot_chain,
    learn_slot_chain,
    most_probable_segments,
    slot_rows,
)

Integers = NDArray[np.int64]


class LeastSpread(NamedTuple):
    """The least standard deviation of each sensor's dimensions: a hand is never surer than that."""

    direction: float = 0.1
    """Of a unit vector's elements."""
    length: float = 0.002
    """m."""
    turn: float = 0.02
    """rad."""
    force: float = 0.2
    """N."""
    torque: float = 0.02
    """N·m."""


class GaussianTaskHmmSettings(NamedTuple):
    """How the task HMM is learned."""

    sensors: Sensors = Sensors()
    """What it looks at; the sensors on by default have twelve dimensions, as in the paper."""
    least_spread: LeastSpread = LeastSpread()
    """Floor of the Gaussians' standard deviations, so that few steps are enough to learn from."""
    any_state: float = 1e-3
    """In each step the task goes to any state whatever with this probability, so that orders never
    trained stay possible; 0 for the strict left-right models of the paper."""


class GaussianTaskHmm(NamedTuple):
    """A task HMM whose states emit independent Gaussian sensor values."""

    sensors: tuple[str, ...]
    """Names of the sensors it looks at."""
    chain: SlotChain
    """Which slot follows which."""
    means: Array
    """Shape (K, F)."""
    variances: Array
    """Shape (K, F)."""


class GaussianTaskHmmRecognizer:
    """The filtered probabilities of the task's states."""

    def __init__(self, model: Model, *, anywhere: bool = False) -> None:
        """Begin as the task does or, with `anywhere`, in any state."""
        self._hmm: GaussianTaskHmm = model.knowledge
        self._reader = StepFeatureReader(self._hmm.sensors, model.axes)
        self._filter = SlotFilter(chain_of(model.task), self._hmm.chain, anywhere=anywhere)

    def step(self, step: Step) -> Recognition:
        """Take the next step; steps come in order, without gaps."""
        row = self._reader.step(step)
        return self._filter.step(step.index, slot_log_emission(self._hmm, row[None])[0])


def segment(model: Model, steps: Sequence[Step], anywhere: bool) -> tuple[StateSegment, ...]:
    """Return the segments of a whole motion, one step at least, by Viterbi."""
    hmm: GaussianTaskHmm = model.knowledge
    log_emission = slot_log_emission(hmm, step_features(steps, hmm.sensors, model.axes))
    return most_probable_segments(
        chain_of(model.task), hmm.chain, log_emission, steps[0].index, anywhere=anywhere
    )


def slot_log_emission(hmm: GaussianTaskHmm, rows: Array) -> Array:
    """Return log P(sensor values | slot), shape (T, K), of rows (T, F).

    Sensors are independent given the slot: what a missing one (NaN) would have said is left out.
    """
    known = ~np.isnan(rows)
    if known.all():
        return log_gaussians(hmm.means, hmm.variances, rows)
    result = np.zeros((len(rows), len(hmm.means)))
    for t, held in enumerate(known):
        result[t] = log_gaussians(hmm.means[:, held], hmm.variances[:, held], rows[t : t + 1, held])
    return result


def _learn(data: TrainingData) -> GaussianTaskHmm:
    settings: GaussianTaskHmmSettings = data.settings
    chain, axes = chain_of(data.task), axes_of(data.task)
    names = available_sensors([each.steps for each in data.segments], settings.sensors)
    if not names:
        raise LearningError(
            "the demonstrations have none of the sensors asked for: switch one of "
            f"{', '.join(Sensors._fields)} on"
        )
    rows = [step_features(each.steps, names, axes) for each in data.segments]
    floor = np.repeat(
        [getattr(settings.least_spread, name) ** 2 for name in names],
        sensor_dimensions(names, axes),
    )
    by_slot = slot_rows(chain, data.segments, rows)
    data.progress(f"{len(by_slot)} states with {len(floor)} dimensions: {', '.join(names)}")
    return GaussianTaskHmm(
        names,
        learn_slot_chain(chain, data.segments, settings.any_state),
        np.array([np.nanmean(own, axis=0) for own in by_slot]),
        np.maximum([np.nanvar(own, axis=0) for own in by_slot], floor),
    )


def _recognizer(model: Model, anywhere: bool) -> Recognizer:
    return GaussianTaskHmmRecognizer(model, anywhere=anywhere)


def _check(hmm: GaussianTaskHmm, task: Task) -> None:
    for name in hmm.sensors:
        check_choice("a sensor", name, Sensors._fields)
    check_within("number of sensors", len(hmm.sensors), 1, len(Sensors._fields))
    slots = len(chain_of(task).slot_state)
    check_slot_chain(hmm.chain, slots)
    shape = (slots, sum(sensor_dimensions(hmm.sensors, axes_of(task))))
    check_shapes(hmm._asdict(), {"means": shape, "variances": shape})
    check_within("means", hmm.means, -LARGEST, LARGEST)
    check_spreads("variances", hmm.variances)


KIND = RecognizerSpec(
    name="task-hmm",
    summary="one HMM state per task state, independent Gaussian sensors, dwell-time transitions",
    source="Hannaford & Lee 1990; thesis 2.3 and (2.33)",
    settings=GaussianTaskHmmSettings,
    knowledge=GaussianTaskHmm,
    learn=_learn,
    recognizer=_recognizer,
    check=_check,
    segment=segment,
)
