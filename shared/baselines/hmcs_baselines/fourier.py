"""Yu's recognizer: Fourier features of the motion in a code book, one discrete HMM a gesteme."""

from __future__ import annotations

from typing import NamedTuple

from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import Recognizer
from hmcs.recognition.registry import RecognizerSpec, TrainingData
from hmcs_baselines.gesteme_hmms import GestemeHmmSettings
from hmcs_baselines.observing import ObservationSettings
from hmcs_baselines.task_level import TaskLevelSettings
from hmcs_baselines.two_levels import (
    Evidence,
    LayeredHmmSettings,
    TwoLevelRecognizer,
    TwoLevels,
    check_two_levels,
    learn_two_levels,
)


class FourierSettings(NamedTuple):
    """The choices of the recognizer on Fourier features."""

    observing: ObservationSettings = ObservationSettings()
    """Numbers of symbols, and the windows."""
    gestemes: GestemeHmmSettings = GestemeHmmSettings()
    """How gesteme HMMs are learned."""
    evidence: Evidence = "winner"
    """What the task HMM is shown: the most probable gesteme or all with their probabilities."""
    task: TaskLevelSettings = TaskLevelSettings()
    """How the task HMM is learned."""


def _learn(data: TrainingData) -> TwoLevels:
    settings = LayeredHmmSettings(
        observations="fourier", restart="network", **data.settings._asdict()
    )
    return learn_two_levels(data, settings)


def _recognizer(model: Model, anywhere: bool) -> Recognizer:
    return TwoLevelRecognizer(model, anywhere=anywhere)


KIND = RecognizerSpec(
    name="fourier",
    summary="discrete gesteme HMMs on a code book of Fourier features, restarted as a network",
    source="Yu, Alqasemi, Dubey & Pernalete 2005, as Aarno 2007, 2.3 and 4.1.1 cites it",
    settings=FourierSettings,
    knowledge=TwoLevels,
    learn=_learn,
    recognizer=_recognizer,
    check=check_two_levels,
)
