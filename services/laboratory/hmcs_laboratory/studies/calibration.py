"""A study of calibration: does what is said to have probability p come true in a share p?"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hmcs.arrays import Array
from hmcs.recognition.scoring import NONE
from hmcs_laboratory.calibration import all_classes_error, brier_score, reliability
from hmcs_laboratory.data.drawn_tasks import any_order, fixed_order
from hmcs_laboratory.data.hands import Count, NotNegative, Positive
from hmcs_laboratory.data.synthetic_tasks import TaskSettings, five_states, six_segments
from hmcs_laboratory.data.tasks import TaskSet
from hmcs_laboratory.methods.online import Followed, Learned, OnlineMethod, followed, learned
from hmcs_laboratory.methods.registered import OnlineNames, online
from hmcs_laboratory.study import Measured, Scalar, Study, seed_from, stream_of

Integers = NDArray[np.int64]

Data = Literal["five-states", "unseen-order", "fixed-order", "any-order"]


class CalibrationSettings(TaskSettings):
    """Of the study `calibration`."""

    performances: Count = 10
    """To recognize, in each trial: many, so that bins are filled."""
    data: Annotated[tuple[Data, ...], Field(min_length=1)] = (
        "five-states",
        "unseen-order",
        "fixed-order",
        "any-order",
    )
    """The task of fig. 4.11; the task of fig. 4.17 in the order never trained, of which gestemes
    are asked for; and human drawings in a fixed and in any order."""
    noise: tuple[NotNegative, ...] = (0.15, 0.3)
    """κ of (3.3)."""
    training: Annotated[int, Field(ge=1, le=5)] = 5
    """Drawings of each shape to learn from; the task is performed with two others."""
    shapes: Annotated[int, Field(ge=2, le=30)] = 10
    """Of the task in which any shape may follow any other; drawn by lot."""
    drawings_dead_zone_m: Positive = 0.0023
    """On the tablet."""
    methods: OnlineNames = ("hmcs-segment-filter", "concatenated-hmm")
    """Any that follow a task; by default those whose probabilities are a filter's."""


class Predictions(NamedTuple):
    """What a method said of all labeled steps of all performances, and what was true."""

    probabilities: Array
    """Of each state or gesteme, shape (N, S)."""
    true: Integers
    """Shape (N,)."""


class _Question(NamedTuple):
    setting: dict[str, Scalar]
    learn_from: TaskSet
    data: TaskSet
    of_gestemes: bool
    seed: int


def calibration_trial(settings: CalibrationSettings, rng: np.random.Generator) -> list[Measured]:
    """Measure how well calibrated every method is on every task."""
    return [
        _measured(method, question)
        for question in _questions(settings, rng)
        for method in online(settings.methods)
    ]


def predictions(what: Followed, data: TaskSet, *, of_gestemes: bool = False) -> Predictions:
    """Return what was believed of states or, as probable as all their states, of gestemes."""
    probabilities = np.concatenate(what.beliefs)
    true = np.concatenate([performance.states for performance in data.performances])
    labeled = true != NONE
    probabilities, true = probabilities[labeled], true[labeled]
    if of_gestemes:
        gesteme = data.gesteme_of_state
        return Predictions(probabilities @ np.eye(gesteme.max() + 1)[gesteme], gesteme[true])
    return Predictions(probabilities, true)


def _measured(method: OnlineMethod, question: _Question) -> Measured:
    able: Learned = learned(method, question.learn_from, stream_of(method.name, question.seed))
    what = followed(able, question.data.performances)
    said = predictions(what, question.data, of_gestemes=question.of_gestemes)
    return Measured(
        method.name,
        question.setting,
        {
            "accuracy": float((said.probabilities.argmax(axis=1) == said.true).mean()),
            "calibration_error": reliability(*said).error,
            "all_states_calibration_error": all_classes_error(*said),
            "brier_score": brier_score(*said),
            **what.times,
        },
    )


def _questions(settings: CalibrationSettings, rng: np.random.Generator) -> Iterator[_Question]:
    # A stream for each task: what is asked of one does not depend on which others are asked for.
    synthetic, fixed, free = rng.spawn(3)
    for noise, stream in zip(settings.noise, synthetic.spawn(len(settings.noise)), strict=True):
        five, six = stream.spawn(2)
        if "five-states" in settings.data:
            data = five_states(settings, noise, five)
            yield _Question(
                {"data": "five-states", "noise": noise}, data, data, False, seed_from(five)
            )
        if "unseen-order" in settings.data:
            trained, unseen = six_segments(settings, noise, six)
            yield _Question(
                {"data": "unseen-order", "noise": noise}, trained, unseen, True, seed_from(six)
            )
    training, zone_m = settings.training, settings.drawings_dead_zone_m
    if "fixed-order" in settings.data:
        data = fixed_order(training, 2, zone_m, fixed)
        yield _Question({"data": "fixed-order"}, data, data, False, seed_from(fixed))
    if "any-order" in settings.data:
        data = any_order(settings.shapes, training, 2, zone_m, free)
        yield _Question({"data": "any-order"}, data, data, False, seed_from(free))


CALIBRATION = Study(
    "calibration",
    "whether probabilities of states can be taken at their word",
    "Guo et al. 2017; Nixon et al. 2019; Brier 1950",
    CalibrationSettings,
    calibration_trial,
    tiny={
        "noise": "0.15",
        "demonstrations": "2",
        "performances": "1",
        "training": "2",
        "data": "unseen-order,any-order",
        "shapes": "3",
        "drawings_dead_zone_m": "0.005",
        "methods": "hmcs-segment-filter,concatenated-hmm",
    },
)
