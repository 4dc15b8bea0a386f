"""The layered segment filter in process: gesteme models in parallel, the task above them.

The services of the two layers wrap the very classes used here, so what runs over the bus is what
runs in process.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from hmcs.errors import UserError
from hmcs.motion.steps import Step
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import PassEvidence, Recognition, StepEvidence
from hmcs.recognition.segment_filter.filter import FilterSettings, SegmentFilter
from hmcs.recognition.segment_filter.gestemes import GestemeBank, GestemeParameters, Scoring
from hmcs.recognition.task_chain import chain_of
from hmcs.recognition.unknown import AlarmSettings, UnknownAlarm


class SegmentFilterModel(NamedTuple):
    """What the layered segment filter knows."""

    parameters: GestemeParameters
    """Of the gestemes in the order of the task."""
    scoring: Scoring
    filter_settings: FilterSettings
    alarm: AlarmSettings


def segment_filter_model(model: Model) -> SegmentFilterModel:
    """Return what the layered segment filter knows.

    Raises UserError where the model was learned for another recognizer.
    """
    if not isinstance(model.knowledge, SegmentFilterModel):
        raise UserError(
            f"model {model.name!r} is for the recognizer {model.recognizer!r}, which is one "
            "process: start hmcs_recognizer with it instead of classifiers and a task HMM"
        )
    return model.knowledge


def bank_of(model: Model, held: Sequence[int] | None = None) -> GestemeBank:
    """Return a fresh bank of the gestemes with the indices `held`, or of all."""
    knowledge = segment_filter_model(model)
    indices = range(len(model.task.gestemes)) if held is None else held
    return GestemeBank(knowledge.parameters, knowledge.scoring, model.axes, indices)


def filter_of(model: Model, *, anywhere: bool = False) -> SegmentFilter:
    """Return a fresh filter for the task; with `anywhere` every state may be the first."""
    return SegmentFilter(
        chain_of(model.task, anywhere=anywhere), segment_filter_model(model).filter_settings
    )


class TaskFilter:
    """The task level of the layered HMM: evidence in, recognition out."""

    def __init__(self, model: Model, *, anywhere: bool = False) -> None:
        """Begin with the task's first state or, with `anywhere`, in any of its states."""
        self._filter = filter_of(model, anywhere=anywhere)
        self._alarm = UnknownAlarm(segment_filter_model(model).alarm)

    @property
    def gestemes(self) -> tuple[int, ...]:
        """Indices of the gestemes the task needs evidence for."""
        return self._filter.gestemes

    def step(self, evidence: StepEvidence) -> Recognition:
        """Take the evidence for the next step."""
        belief = self._filter.step(evidence)
        return Recognition(belief, *self._alarm.step(belief.log_likelihood, belief.unknown))


class SegmentFilterRecognizer:
    """The whole layered HMM in one object: gesteme models in parallel, the task above them."""

    def __init__(
        self, model: Model, *, anywhere: bool = False, passed: PassEvidence = lambda made: made
    ) -> None:
        """Begin as `TaskFilter` does; `passed` says what evidence reaches the task level."""
        self._bank = bank_of(model)
        self._passed = passed
        self.task = TaskFilter(model, anywhere=anywhere)

    def step(self, step: Step) -> Recognition:
        """Take the next step; steps come in order, without gaps."""
        evidence = self._passed(self._bank.step(step))
        return self.task.step(evidence)._replace(evidence=evidence)
