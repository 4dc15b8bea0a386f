"""The thesis' layered HMM: gesteme HMMs on directions of motion, a task HMM above them."""

from __future__ import annotations

from typing import NamedTuple

from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import Recognizer
from hmcs.recognition.registry import Kind, Lesson
from hmcs_baselines.gesteme_hmms import GestemeHmmSettings
from hmcs_baselines.observing import ObservationSettings, Observed
from hmcs_baselines.restarting import CusumSettings, Restart
from hmcs_baselines.task_level import TaskLevelSettings
from hmcs_baselines.two_levels import (
    Evidence,
    TwoLevelRecognizer,
    TwoLevels,
    TwoLevelSettings,
    check_two_levels,
    learn_two_levels,
)


class LayeredHmmSettings(NamedTuple):
    """The choices of the layered HMM."""

    observations: Observed = "od"
    """What the gesteme HMMs observe; see there."""
    observing: ObservationSettings = ObservationSettings()
    """Numbers of symbols, and the windows."""
    gestemes: GestemeHmmSettings = GestemeHmmSettings()
    """How gesteme HMMs are learned."""
    restart: Restart = "network"
    """When the gesteme HMMs begin anew: where the pedal says (given: as the thesis evaluates
    them), by the CUSUM test, all the time in a network as Li and Okamura's, or never. The default
    asks nothing of the operator."""
    cusum: CusumSettings = CusumSettings()
    """The test, where restarts are found by it."""
    evidence: Evidence = "winner"
    """What the task HMM is shown: the most probable gesteme, as in the thesis, or all of them with
    their probabilities (soft), which halves the false switches."""
    task: TaskLevelSettings = TaskLevelSettings()
    """How the task HMM is learned."""


def _learn(lesson: Lesson) -> TwoLevels:
    return learn_two_levels(lesson, TwoLevelSettings(**lesson.settings._asdict()))


def _recognizer(model: Model, anywhere: bool) -> Recognizer:
    return TwoLevelRecognizer(model, anywhere=anywhere)


KIND = Kind(
    name="lhmm",
    summary="layered HMM: gesteme HMMs on OD, MD or FFT symbols, a task HMM on their winner",
    source="Aarno 2007, chapter 4",
    settings=LayeredHmmSettings,
    knowledge=TwoLevels,
    learn=_learn,
    recognizer=_recognizer,
    check=check_two_levels,
)
