"""The thesis' layered HMM: gesteme HMMs on directions of motion, a task HMM above them."""

from __future__ import annotations

from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import Recognizer
from hmcs.recognition.registry import RecognizerSpec, TrainingData
from hmcs_baselines.two_levels import (
    LayeredHmmSettings,
    TwoLevelRecognizer,
    TwoLevels,
    check_two_levels,
    learn_two_levels,
)


def _learn(data: TrainingData) -> TwoLevels:
    return learn_two_levels(data, data.settings)


def _recognizer(model: Model, anywhere: bool) -> Recognizer:
    return TwoLevelRecognizer(model, anywhere=anywhere)


KIND = RecognizerSpec(
    name="lhmm",
    summary="layered HMM: gesteme HMMs on OD, MD or FFT symbols, a task HMM on their winner",
    source="Aarno 2007, chapter 4",
    settings=LayeredHmmSettings,
    knowledge=TwoLevels,
    learn=_learn,
    recognizer=_recognizer,
    check=check_two_levels,
)
