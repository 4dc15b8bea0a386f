"""A recognizer to which evidence can be missing as it was live."""

from __future__ import annotations

import numpy as np

from hmcs.motion.steps import Step
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import Guarded, Recognition, Recognizer, StepEvidence
from hmcs.recognition.registry import recognizer_of
from hmcs.recognition.segment_filter.recognizer import (
    Precision,
    SegmentFilterModel,
    SegmentFilterRecognizer,
    TaskFilter,
)


class AsLive:
    """A model's recognizer; of a layered one evidence can be missing as it was live."""

    def __init__(self, model: Model, anywhere: bool, precision: Precision) -> None:
        self._task: _LackingTask | None = None
        if isinstance(model.knowledge, SegmentFilterModel):
            layered = SegmentFilterRecognizer(model, anywhere=anywhere, precision=precision)
            layered.task = self._task = _LackingTask(model, anywhere=anywhere)
            self._recognizer: Recognizer = Guarded(layered)
        else:
            self._recognizer = recognizer_of(model, anywhere=anywhere)

    def step(self, step: Step, missing: frozenset[int]) -> Recognition:
        """Take the next step, without evidence of the gestemes `missing`."""
        if self._task is not None:
            self._task.missing = missing
        return self._recognizer.step(step)


class _LackingTask(TaskFilter):
    """The task level, which evidence of some gestemes does not reach."""

    missing: frozenset[int] = frozenset()

    def step(self, evidence: StepEvidence) -> Recognition:
        """Take the evidence for the next step but what is missing."""
        if self.missing:
            kept = ~np.isin(evidence.pair_gesteme, list(self.missing))
            evidence = StepEvidence(
                evidence.step,
                tuple(g for g in evidence.gestemes if g not in self.missing),
                evidence.pair_gesteme[kept],
                evidence.pair_start[kept],
                evidence.exit[kept],
                evidence.log_ratio[kept],
            )
        return super().step(evidence)
