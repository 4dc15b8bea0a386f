"""The studies there are. Adding one is a file here and a line in `STUDIES`."""

from __future__ import annotations

from typing import Any

from hmcs_laboratory.studies.assistance import ASSISTANCE
from hmcs_laboratory.studies.calibration import CALIBRATION
from hmcs_laboratory.studies.directions import DIRECTIONS
from hmcs_laboratory.studies.drawings import LASA
from hmcs_laboratory.studies.experiments import EXPERIMENT_1, EXPERIMENT_2, EXPERIMENT_3
from hmcs_laboratory.studies.force_tasks import FORCE_TASK_2D, FORCE_TASK_3D
from hmcs_laboratory.studies.gestemes import (
    GESTEME_COUNT,
    NOISE,
    PARTIAL,
    PEERS,
    TRAINING_COUNT,
)
from hmcs_laboratory.studies.misclassified import MISCLASSIFIED
from hmcs_laboratory.studies.scale import SCALE
from hmcs_laboratory.studies.symbols import SYMBOL_COUNT
from hmcs_laboratory.studies.tasks import LASA_TASKS, ORDER, RESTART
from hmcs_laboratory.studies.unknown import UNKNOWN
from hmcs_laboratory.studies.unlabeled import UNLABELED
from hmcs_laboratory.study import Study

STUDIES: tuple[Study[Any], ...] = (
    PEERS,
    NOISE,
    GESTEME_COUNT,
    TRAINING_COUNT,
    SYMBOL_COUNT,
    PARTIAL,
    RESTART,
    MISCLASSIFIED,
    ORDER,
    SCALE,
    LASA,
    LASA_TASKS,
    UNLABELED,
    DIRECTIONS,
    UNKNOWN,
    CALIBRATION,
    ASSISTANCE,
    EXPERIMENT_1,
    EXPERIMENT_2,
    EXPERIMENT_3,
    FORCE_TASK_2D,
    FORCE_TASK_3D,
)
