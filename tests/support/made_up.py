"""A model nobody learned: one gesteme that is a line, for tests that need a model to be there."""

from __future__ import annotations

import numpy as np

from hmcs.recognition.model import Model
from hmcs.recognition.segment_filter.exits import DEFAULT_WEIGHTS
from hmcs.recognition.segment_filter.filter import FilterSettings
from hmcs.recognition.segment_filter.gestemes import GestemeParameters, Scoring
from hmcs.recognition.segment_filter.recognizer import SegmentFilterModel
from hmcs.recognition.segment_filter.sensor_densities import SensorDensities
from hmcs.recognition.unknown import AlarmSettings
from hmcs.task import Task

SPREAD_M = 0.005


def line_model(name: str, task: Task, points: np.ndarray) -> Model:
    """Return a model of a task with one gesteme, whose path goes through `points`, m, (K, 3)."""
    phases = np.full((1, 2), 0.25)
    return Model(
        name=name,
        hash="",
        task=task,
        recognizer="segment-filter",
        knowledge=SegmentFilterModel(
            GestemeParameters(
                means=np.zeros((1, 2, 6)),
                variances=np.ones((1, 2, 6)),
                initial=np.array([[1.0, 0.0]]),
                stay=phases,
                advance=phases,
                skip=phases,
                remaining=phases,
                variant=np.zeros((1, 2), dtype=np.int32),
                ends=np.zeros((1, 1, 3)),
                normals=np.zeros((1, 1, 3)),
                exit_weights=DEFAULT_WEIGHTS,
                step_m=0.01,
                senses=SensorDensities((), np.zeros((1, 2, 0)), np.ones((1, 2, 0)), np.zeros(0)),
            ),
            Scoring(0.0, 1.0, 100, 30.0),
            FilterSettings(),
            AlarmSettings(20, -5.0, -20.0),
        ),
        path_points=(points,),
        path_spreads=(np.full(len(points), SPREAD_M),),
        demonstrations=("made up",),
    )
