"""What the segment filter's knowledge must be: arrays that fit, probabilities, positive widths."""

from __future__ import annotations

import numpy as np

from hmcs.recognition.checking import (
    LARGEST,
    LEAST_SPREAD,
    check_choice,
    check_distributions,
    check_leaving,
    check_shapes,
    check_spreads,
    check_within,
)
from hmcs.recognition.model import axes_of
from hmcs.recognition.segment_filter.exits import DEFAULT_WEIGHTS
from hmcs.recognition.segment_filter.filter import FilterSettings
from hmcs.recognition.segment_filter.gestemes import (
    LONGEST_WINDOW_STEPS,
    GestemeParameters,
    Scoring,
)
from hmcs.recognition.segment_filter.recognizer import SegmentFilterModel
from hmcs.recognition.segment_filter.sensor_densities import SensorDensities
from hmcs.recognition.step_features import Sensors, sensor_dimensions
from hmcs.recognition.unknown import AlarmSettings
from hmcs.task import Task

LONGEST_ALARM_STEPS = 10_000
"""The alarm remembers so many steps at most."""


def check_segment_filter(knowledge: SegmentFilterModel, task: Task) -> None:
    """Raise ValueError where the arrays do not fit together, or not the task, or a number is none
    that the filter can compute with."""
    _check_parameters(knowledge.parameters, task)
    _check_sensor_densities(knowledge.parameters.senses, knowledge.parameters.initial.shape)
    _check_scoring(knowledge.scoring)
    check_filter_settings(knowledge.filter_settings)
    _check_alarm(knowledge.alarm)


def check_filter_settings(settings: FilterSettings) -> None:
    """Raise ValueError where they are no probabilities, or leave no way to unknown motion and back.

    Without such a way no hypothesis at all is left of a motion that nothing in the task explains.
    """
    for name in ("unknown_after", "abandon"):
        check_within(name, getattr(settings, name), LEAST_SPREAD, 1.0)
    for name in ("again", "recover", "any_state"):
        check_within(name, getattr(settings, name), 0.0, 1.0)
    check_within("drop_below", settings.drop_below, 0.0, 0.1)
    check_within("abandon", settings.abandon, 0.0, 0.5)
    check_within("recover", settings.recover, 0.0, 0.999)
    check_within("any_state + unknown_after", settings.any_state + settings.unknown_after, 0.0, 1.0)


def _check_parameters(p: GestemeParameters, task: Task) -> None:
    gestemes, axes = len(task.gestemes), len(axes_of(task))
    shape = p.initial.shape
    if len(shape) != 2 or shape[0] != gestemes or shape[1] < 1:
        raise ValueError(
            f"its arrays are for gestemes and phases of shape {shape}, its task has {gestemes} "
            "gestemes"
        )
    if p.ends.ndim != 3 or p.ends.shape[1] < 1:
        raise ValueError(f"array 'ends' is of shape {p.ends.shape}, expected one a variant")
    variants = (gestemes, p.ends.shape[1], axes)
    arrays = p._asdict()
    per_phase = ("initial", "stay", "advance", "skip", "remaining")
    check_shapes(
        arrays,
        {
            **dict.fromkeys(per_phase, shape),
            "means": (*shape, 2 * axes),
            "variances": (*shape, 2 * axes),
            "ends": variants,
            "normals": variants,
            "exit_weights": DEFAULT_WEIGHTS.shape,
        },
    )
    check_shapes(arrays, {"variant": shape}, np.int32)
    check_spreads("positive variances", p.variances)
    for name in ("means", "ends", "exit_weights"):
        check_within(name, arrays[name], -LARGEST, LARGEST)
    check_within("normals", p.normals, -1.001, 1.001)
    check_within("remaining", p.remaining, 0.0, LARGEST)
    check_within("variant", p.variant, 0, variants[1] - 1)
    check_spreads("step_m", p.step_m)
    check_distributions("initial", p.initial)
    check_leaving("stay, advance and skip", np.stack([p.stay, p.advance, p.skip], axis=-1))
    impossible = p.stay + p.advance + p.skip <= 0
    if (p.initial[impossible] > 0).any():
        raise ValueError("array 'initial' lets a gesteme begin in a phase that is none")


def _check_sensor_densities(senses: SensorDensities, phases: tuple[int, ...]) -> None:
    for name in senses.names:
        check_choice("a sense", name, Sensors._fields)
    count = sum(sensor_dimensions(senses.names, ()))
    check_shapes(
        senses._asdict(),
        {"means": (*phases, count), "variances": (*phases, count), "weights": (count,)},
    )
    check_within("means of senses", senses.means, -LARGEST, LARGEST)
    check_spreads("variances of senses", senses.variances)
    check_within("weights of senses", senses.weights, 0.0, 1e3)


def _check_scoring(scoring: Scoring) -> None:
    check_within("background", scoring.background, -LARGEST, LARGEST)
    check_within("temperature", scoring.temperature, 1e-6, 1e6)
    check_within("window_steps", scoring.window_steps, 1, LONGEST_WINDOW_STEPS)
    check_within("prune_nats", scoring.prune_nats, 0.0, 1e6)
    if scoring.alignment.sigma != 0:
        check_within("alignment.sigma", scoring.alignment.sigma, 1e-6, 10.0)
    check_within("alignment.temperature", scoring.alignment.temperature, 1e-6, 1e6)


def _check_alarm(alarm: AlarmSettings) -> None:
    check_within("alarm.window_steps", alarm.window_steps, 1, LONGEST_ALARM_STEPS)
    check_within("alarm.threshold", alarm.threshold, -LARGEST, LARGEST)
    check_within("alarm.floor", alarm.floor, -LARGEST, LARGEST)
