"""Recognizers in process: objects that turn steps into beliefs.

A recognizer is anything with `step(Step) -> Recognition`. The services wrap the very classes used
here, so what runs over the bus is what runs in process.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

from hmcs.motion.steps import Step
from hmcs.recognition.segment_filter import TaskBelief


class Recognition(NamedTuple):
    """What is believed after a step, and whether it is believed at all."""

    belief: TaskBelief
    mean_log_likelihood: float
    """Mean of the belief's log-likelihoods over the alarm window, nats."""
    unknown_alarm: bool
    """True where that mean is below the model's threshold."""


class Recognizer(Protocol):
    """Turns steps into beliefs."""

    def step(self, step: Step) -> Recognition:
        """Take the next step; steps come in order, without gaps."""
        ...
