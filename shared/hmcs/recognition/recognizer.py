"""Recognizers in process: objects that turn steps into beliefs.

A recognizer is anything with `step(Step) -> Recognition`. The services wrap the very classes used
here, so what runs over the bus is what runs in process.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from hmcs.motion.steps import Step
from hmcs.recognition.gestemes import StepEvidence
from hmcs.recognition.segment_filter import TaskBelief


class Recognition(NamedTuple):
    """What is believed after a step, and whether it is believed at all."""

    belief: TaskBelief
    mean_log_likelihood: float
    """How well the last steps fit the task: mean over the alarm window, nats."""
    unknown_alarm: bool
    """True where that mean is below the model's threshold."""
    evidence: StepEvidence | None = None
    """What the gesteme models made of the step; None where there is no such layer below."""


class Recognizer(Protocol):
    """Turns steps into beliefs."""

    def step(self, step: Step) -> Recognition:
        """Take the next step; steps come in order, without gaps."""
        ...


class BadStepError(ValueError):
    """A step that no recognizer may be shown; nothing changes by it."""


class Guarded:
    """Shows a recognizer only steps that are steps, in order and without gaps."""

    def __init__(self, recognizer: Recognizer) -> None:
        self._recognizer = recognizer
        self._next: int | None = None

    def step(self, step: Step) -> Recognition:
        """Take the next step.

        Raises BadStepError for a step out of order, or with a position, displacement or sense
        that is not finite or of another shape.
        """
        if self._next is not None and step.index != self._next:
            raise BadStepError(f"step {step.index} came, expected {self._next}")
        for field, shape in _SHAPES.items():
            value = getattr(step, field)
            if value is None and field in _OPTIONAL:
                continue
            if np.shape(value) != shape or not np.isfinite(value).all():
                raise BadStepError(
                    f"step {step.index}: {field} is {value!r}, expected finite numbers of shape "
                    f"{shape}"
                )
        recognition = self._recognizer.step(step)
        self._next = step.index + 1
        return recognition


_SHAPES = {"position": (3,), "displacement": (3,), "orientation": (4,), "wrench": (6,)}
_OPTIONAL = ("orientation", "wrench")
