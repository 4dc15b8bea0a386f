"""More senses: how the hand turns and what force it uses, beside where it is and how it moves.

Each sense is a stream of its own, independent of the others given the phase, with a weight: its
log density counts so many times (the thesis' next step, chapter 5). What a step's senses say does
not depend on where a segment started, so it is worked out once for all pairs.
Shapes: G gestemes, N phases, S dimensions of all senses together, T steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.recognition.segments import LearningError, Segment
from hmcs.recognition.step_features import (
    Sensors,
    available_sensors,
    sensor_dimensions,
    step_features,
)

_FLOOR_SHARE = 0.25
"""No phase is surer of a sense than this share of the sense's spread over all gestemes."""
_LEAST_SPREAD = 1e-3
"""rad, N or N·m: finer than any device."""


class SensorWeights(NamedTuple):
    """How much each further sense counts; a sense of weight 0 is not looked at."""

    turn: float = 0.0
    """Of the hand from step to step."""
    force: float = 0.0
    """Of the operator."""
    torque: float = 0.0
    """Of the operator."""


class SensorDensities(NamedTuple):
    """What phases expect of the further senses."""

    names: tuple[str, ...]
    means: Array
    """rad, N and N·m, shape (G, N, S)."""
    variances: Array
    """Shape (G, N, S)."""
    weights: Array
    """Shape (S,)."""


def sensors_used(segments: Sequence[Segment], weights: SensorWeights) -> tuple[str, ...]:
    """Return the senses looked at.

    Raises LearningError where a demonstration lacks one of them.
    """
    wanted = Sensors(False, False, weights.turn > 0, weights.force > 0, weights.torque > 0)
    names = tuple(name for name, used in wanted._asdict().items() if used)
    for segment in segments:
        lacking = set(names) - set(available_sensors([segment.steps], wanted))
        if lacking:
            raise LearningError(
                f"demonstration {segment.demonstration!r} has no {', '.join(sorted(lacking))}: "
                "record it, or set its weight to 0"
            )
    return names


def sensor_rows(segment: Segment, names: Sequence[str]) -> Array:
    """Return what the senses say of each step of a segment, shape (T, S).

    The turn of the first step is that of the second: nothing is known before it.
    """
    if not names:
        return np.zeros((len(segment.steps), 0))
    rows = step_features(segment.steps, names, ())
    unknown = np.isnan(rows[0])
    rows[0, unknown] = rows[1, unknown]
    return rows


def sensor_weights(names: Sequence[str], weights: SensorWeights) -> Array:
    """Return the weight of each dimension, shape (S,)."""
    own = [getattr(weights, name) for name in names]
    return np.repeat(np.array(own, dtype=np.float64), sensor_dimensions(names, ()))


def variance_floors(rows: Sequence[Array]) -> Array:
    """Return the least variance of each dimension, shape (S,), from all segments' rows."""
    spread = np.concatenate(list(rows)).std(axis=0)
    return np.asarray(np.maximum(_FLOOR_SHARE * spread, _LEAST_SPREAD) ** 2)


def log_densities(senses: SensorDensities, values: Array) -> Array:
    """Return what one step's senses say of each phase, weighted, nats, shape (G, N).

    `values` (S,) is NaN where a sense is silent: it then counts as it does on average, so that
    silence speaks neither for nor against the task. Not by `log_gaussian`: summed in this order,
    recordings of earlier versions are replayed to the last bit.
    """
    silent = np.isnan(values)
    squares = (np.where(silent, 0.0, values) - senses.means) ** 2 / senses.variances
    terms = np.where(silent, 1.0, squares) + np.log(2.0 * np.pi * senses.variances)
    return np.asarray((-0.5 * senses.weights * terms).sum(axis=2))
