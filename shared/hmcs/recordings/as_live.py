"""A recognizer to which evidence can be missing as it was live."""

from __future__ import annotations

from hmcs.motion.steps import Step
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import Guarded, Precision, Recognition, StepEvidence
from hmcs.recognition.registry import kind_named, recognizer_of


class AsLive:
    """A model's recognizer; of a layered one evidence can be missing as it was live."""

    def __init__(self, model: Model, anywhere: bool, precision: Precision) -> None:
        self._precision = precision
        self._missing: frozenset[int] = frozenset()
        layered = kind_named(model.recognizer).layered
        if layered is None:
            self._recognizer = recognizer_of(model, anywhere=anywhere)
        else:
            self._recognizer = Guarded(layered(model, anywhere, self._arrived))

    def step(self, step: Step, missing: frozenset[int]) -> Recognition:
        """Take the next step, without evidence of the gestemes `missing`."""
        self._missing = missing
        return self._recognizer.step(step)

    def _arrived(self, evidence: StepEvidence) -> StepEvidence:
        rounded = evidence.rounded(self._precision)
        return rounded.without(self._missing) if self._missing else rounded
