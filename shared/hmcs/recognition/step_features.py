"""What the sensors of a hand say of a step: those of Hannaford & Lee (1990), wherever it is.

Their positions become directions and their orientations turns, so that a task may be performed
anywhere.

Shapes: T steps, F dimensions.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.quaternions import between
from hmcs.motion.steps import Step


class Sensors(NamedTuple):
    """Which sensors are looked at, where the demonstrations have them."""

    direction: bool = True
    """Of motion, a unit vector on the task's axes."""
    length: bool = False
    """Of the step, m. The dead zone leaves little in it."""
    turn: bool = True
    """Of the hand since the step before, rotation vector, rad."""
    force: bool = True
    """Of the operator, N."""
    torque: bool = True
    """Of the operator, N·m."""


class StepFeatureReader:
    """Reads sensors step by step; a sensor that has nothing to say gives NaN."""

    def __init__(self, names: Sequence[str], axes: Sequence[int]) -> None:
        """Read the sensors of these names, all fields of `Sensors`, on these axes."""
        self._names = tuple(names)
        self._axes = list(axes)
        self._orientation: Array | None = None

    def step(self, step: Step) -> Array:
        """Return the sensor values of the next step, shape (F,)."""
        parts = [self._read(name, step) for name in self._names]
        self._orientation = step.orientation
        return np.concatenate(parts)

    def _read(self, name: str, step: Step) -> Array:
        along = step.displacement[self._axes]
        if name == "direction":
            length_m = float(np.linalg.norm(along))
            return along / length_m if length_m > 0 else along
        if name == "length":
            return np.array([np.linalg.norm(step.displacement)])
        if name == "turn":
            if step.orientation is None or self._orientation is None:
                return np.full(3, np.nan)
            return between(self._orientation, step.orientation)
        if step.wrench is None:
            return np.full(3, np.nan)
        return step.wrench[:3] if name == "force" else step.wrench[3:]


def step_features(steps: Iterable[Step], names: Sequence[str], axes: Sequence[int]) -> Array:
    """Return the sensor values of a whole motion, shape (T, F)."""
    reader = StepFeatureReader(names, axes)
    return np.array([reader.step(step) for step in steps])


def available_sensors(motions: Iterable[Sequence[Step]], sensors: Sensors) -> tuple[str, ...]:
    """Return the names of those sensors that all motions have."""
    steps = [step for motion in motions for step in motion]
    absent = set()
    if any(step.orientation is None for step in steps):
        absent |= {"turn"}
    if any(step.wrench is None for step in steps):
        absent |= {"force", "torque"}
    return tuple(name for name, used in sensors._asdict().items() if used and name not in absent)


def sensor_dimensions(names: Sequence[str], axes: Sequence[int]) -> tuple[int, ...]:
    """Return how many dimensions each sensor has."""
    own = {"direction": len(axes), "length": 1}
    return tuple(own.get(name, 3) for name in names)
