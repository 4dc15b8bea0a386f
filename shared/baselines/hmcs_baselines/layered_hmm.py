"""Gesteme HMMs in parallel with a task HMM above them or none: three kinds, by their defaults."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from hmcs.motion.steps import Step
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import Recognizer
from hmcs.recognition.registry import RecognizerSpec, TrainingData
from hmcs.recognition.segmentation import StateSegment
from hmcs_baselines.classifying import Gestemes
from hmcs_baselines.restarting import CusumSettings
from hmcs_baselines.two_levels import (
    LayeredHmmSettings,
    TwoLevelRecognizer,
    TwoLevels,
    check_two_levels,
    learn_two_levels,
    segment_two_levels,
)


def _learn(data: TrainingData) -> TwoLevels:
    return learn_two_levels(data, data.settings)


def _recognizer(model: Model, anywhere: bool) -> Recognizer:
    return TwoLevelRecognizer(model, anywhere=anywhere)


def _segment(model: Model, steps: Sequence[Step], anywhere: bool) -> tuple[StateSegment, ...]:
    return segment_two_levels(model, steps, anywhere=anywhere)


def _from_gestemes_alone(plain: Any) -> Any:
    """Model files of the online network once held the gestemes and nothing around them."""
    if not isinstance(plain, dict) or set(plain) != set(Gestemes._fields):
        return plain
    cusum = CusumSettings()._asdict()
    return {
        "gestemes": plain,
        "task": None,
        "restart": "network",
        "cusum": cusum,
        "evidence": "none",
    }


KIND = RecognizerSpec(
    name="lhmm",
    summary="layered HMM: gesteme HMMs on OD, MD or FFT symbols, a task HMM on their winner",
    source="Aarno 2007, chapter 4",
    settings=LayeredHmmSettings,
    knowledge=TwoLevels,
    learn=_learn,
    recognizer=_recognizer,
    check=check_two_levels,
    segment=_segment,
)
CHAPTER_4 = KIND._replace(
    name="chapter-4",
    summary="layered HMM restarted where the pedal says, its task HMM on the winner",
    source="Aarno 2007, 4.1-4.2",
    settings=partial(LayeredHmmSettings, restart="given"),
)
FOURIER = KIND._replace(
    name="fourier",
    summary="discrete gesteme HMMs on a code book of Fourier features, restarted as a network",
    source="Yu, Alqasemi, Dubey & Pernalete 2005, as Aarno 2007, 2.3 and 4.1.1 cites it",
    settings=partial(LayeredHmmSettings, observations="fourier", restart="network"),
)
ONLINE_NETWORK = KIND._replace(
    name="online-network",
    summary="gesteme HMMs that are all always restarted, from the end of any; no task HMM",
    source="Li & Okamura 2003, as Aarno 2007, 2.34–2.35 gives it",
    settings=partial(
        LayeredHmmSettings, observations="direction", restart="network", evidence="none"
    ),
    segment=None,
    from_older=_from_gestemes_alone,
)
