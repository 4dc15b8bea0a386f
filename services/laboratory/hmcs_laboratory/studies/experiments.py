"""The three experiments of chapter 3, on the task's own arm among its obstacles."""

from __future__ import annotations

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


def experiment_1(settings: ExperimentSettings, rng: np.random.Generator) -> list[Measured]:
    """Follow the taught path in a narrow workspace (3.3.1)."""
    return _measured(1, settings, rng)


def experiment_2(settings: ExperimentSettings, rng: np.random.Generator) -> list[Measured]:
    """Follow it over a wall whose height changed after training (3.3.2)."""
    return _measured(2, settings, rng)


def experiment_3(settings: ExperimentSettings, rng: np.random.Generator) -> list[Measured]:
    """Leave it for an obstacle that was not there in training (3.3.3)."""
    return _measured(3, settings, rng)


def _measured(
    number: int, settings: ExperimentSettings, rng: np.random.Generator
) -> list[Measured]:
    name = f"experiment-{number}"
    return measured_in({name: EXPERIMENTS[name]}, settings, rng)


_TINY = {"law": "chapter-3", "demonstrations": "2", "robot": "lag"}
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

EXPERIMENT_1 = Study(
    "experiment-1",
    "chapter 3, experiment 1: following the taught path on a PUMA 560",
    "Aarno 2007, 3.3.1",
    ExperimentSettings,
    experiment_1,
    trials=5,
    tiny=_TINY,
    table=_TABLE,
)
EXPERIMENT_2 = Study(
    "experiment-2",
    "chapter 3, experiment 2: an obstacle of another size than in training",
    "Aarno 2007, 3.3.2",
    ExperimentSettings,
    experiment_2,
    trials=5,
    tiny=_TINY,
    table=_TABLE,
)
EXPERIMENT_3 = Study(
    "experiment-3",
    "chapter 3, experiment 3: an obstacle that was not there in training",
    "Aarno 2007, 3.3.3",
    ExperimentSettings,
    experiment_3,
    trials=5,
    tiny=_TINY,
    table=_TABLE,
)
