"""The three experiments of chapter 3, on the task's own arm among its obstacles."""

from __future__ import annotations

from functools import partial

import numpy as np

from hmcs_laboratory.assistance.scenarios import (
    AssistedTask,
    as_taught,
    changed_obstacle,
    unexpected_obstacle,
)
from hmcs_laboratory.studies.assistance import LawNames, LoopSettings, measured_in
from hmcs_laboratory.study import Measured, Study


class ExperimentSettings(LoopSettings):
    """Who performs the experiment, with which fixtures."""

    law: LawNames = ("chapter-3", "insistence")
    """Laws to measure; the operator alone is always measured."""
    robot: str = "physics"
    """`physics` is the task's arm among its obstacles, `lag` a tool that follows with a delay."""


EXPERIMENTS = {
    "experiment-1": AssistedTask("lines", as_taught),
    "experiment-2": AssistedTask("lines", changed_obstacle),
    "experiment-3": AssistedTask("lines", unexpected_obstacle),
}


def experiment_trial(
    name: str, settings: ExperimentSettings, rng: np.random.Generator
) -> list[Measured]:
    """Measure every law in the experiment of that name."""
    return measured_in({name: EXPERIMENTS[name]}, settings, rng)


def _study(number: int, what: str) -> Study[ExperimentSettings]:
    name = f"experiment-{number}"
    return Study(
        name,
        f"chapter 3, experiment {number}: {what}",
        f"Aarno 2007, 3.3.{number}",
        ExperimentSettings,
        partial(experiment_trial, name),
        trials=5,
        tiny={"law": "chapter-3", "demonstrations": "2", "robot": "lag"},
        table=_TABLE,
    )


_TABLE = (
    "law",
    "error_ratio",
    "error_mm",
    "time_ratio",
    "fighting",
    "arrived",
    "collisions",
    "leave_ratio",
    "clearance_mm",
)

EXPERIMENT_1 = _study(1, "following the taught path on a PUMA 560")
EXPERIMENT_2 = _study(2, "an obstacle of another size than in training")
EXPERIMENT_3 = _study(3, "an obstacle that was not there in training")
