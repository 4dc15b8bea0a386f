"""Recognizers in process: objects that turn steps into beliefs.

A recognizer is anything with `step(Step) -> Recognition`. The services wrap the very classes used
here, so what runs over the bus is what runs in process.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

from hmcs.motion.steps import Step
from hmcs.recognition.gestemes import StepEvidence
from hmcs.recognition.model import Model
from hmcs.recognition.segment_filter import TaskBelief
from hmcs.recognition.unknown import UnknownAlarm


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


class TaskRecognizer:
    """The task level of the layered HMM: evidence in, recognition out."""

    def __init__(self, model: Model, *, anywhere: bool = False) -> None:
        """Begin with the task's first state or, with `anywhere`, in any of its states."""
        self._filter = model.filter(anywhere=anywhere)
        self._alarm = UnknownAlarm(model.alarm)

    @property
    def gestemes(self) -> tuple[int, ...]:
        """Indices of the gestemes the task needs evidence for."""
        return self._filter.gestemes

    def step(self, evidence: StepEvidence) -> Recognition:
        """Take the evidence for the next step."""
        belief = self._filter.step(evidence)
        return Recognition(belief, *self._alarm.step(belief.log_likelihood))


class LayeredRecognizer:
    """The whole layered HMM in one object: gesteme models in parallel, the task above them."""

    def __init__(self, model: Model, *, anywhere: bool = False) -> None:
        """Begin as `TaskRecognizer` does."""
        self._bank = model.bank()
        self.task = TaskRecognizer(model, anywhere=anywhere)

    def step(self, step: Step) -> Recognition:
        """Take the next step; steps come in order, without gaps."""
        return self.task.step(self._bank.step(*step))
