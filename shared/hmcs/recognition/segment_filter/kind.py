"""The layered segment filter, the default: restart is inferred, not assumed."""

from __future__ import annotations

from collections.abc import Sequence

from hmcs.motion.steps import Step
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import PassEvidence, Recognizer
from hmcs.recognition.registry import RecognizerSpec, TrainingData
from hmcs.recognition.segment_filter.checking import check_segment_filter
from hmcs.recognition.segment_filter.gesteme_learning import LearningSettings
from hmcs.recognition.segment_filter.learning import learn_segment_filter
from hmcs.recognition.segment_filter.offline import OfflineSegmenter
from hmcs.recognition.segment_filter.recognizer import (
    SegmentFilterModel,
    SegmentFilterRecognizer,
    bank_of,
    segment_filter_model,
)
from hmcs.recognition.segmentation import StateSegment
from hmcs.recognition.task_chain import chain_of


def _learn(data: TrainingData) -> SegmentFilterModel:
    return learn_segment_filter(data.task, data.segments, data.settings, data.progress)


def _recognizer(model: Model, anywhere: bool) -> Recognizer:
    return SegmentFilterRecognizer(model, anywhere=anywhere)


def _segment(model: Model, steps: Sequence[Step], anywhere: bool) -> tuple[StateSegment, ...]:
    bank = bank_of(model)
    return OfflineSegmenter(
        chain_of(model.task, anywhere=anywhere),
        segment_filter_model(model).filter_settings,
        [bank.step(step) for step in steps],
    ).segments()


def _layered(model: Model, anywhere: bool, passed: PassEvidence) -> Recognizer:
    return SegmentFilterRecognizer(model, anywhere=anywhere, passed=passed)


KIND = RecognizerSpec(
    name="segment-filter",
    summary="exact filter over (task state, segment start, gesteme phase) with an unknown state",
    source="HMCS; solves the restart problem of Aarno 2007, chapters 4 and 5",
    settings=LearningSettings,
    knowledge=SegmentFilterModel,
    learn=_learn,
    recognizer=_recognizer,
    check=check_segment_filter,
    layered=_layered,
    segment=_segment,
)
