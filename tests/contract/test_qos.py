"""The table of transport profiles is whole and keeps its rules."""

from __future__ import annotations

from hmcs.bus.messages import (
    MESSAGES,
    ActivateRecognizer,
    Ask,
    ChangeRecording,
    Command,
    Description,
    Done,
    Evidence,
    Health,
    LastSteps,
    LastStepsQuestion,
    LoadModel,
    ModelFile,
    ModelQuestion,
    Motion,
    Outline,
    OutlineQuestion,
    Record,
    Refusal,
    RobotDescription,
    Segmentation,
    SegmentQuestion,
    SetLabels,
    SettingsReport,
    Step,
    Train,
)
from hmcs.bus.qos import QOS_PROFILES, QosProfile

BY_QUERY = {
    Ask, Refusal, Health, Description, SettingsReport, LastStepsQuestion, LastSteps, LoadModel,
    ModelQuestion, ModelFile, ActivateRecognizer, RobotDescription, Record, Train, OutlineQuestion,
    Outline, SetLabels, ChangeRecording, SegmentQuestion, Segmentation, Done,
}  # fmt: skip


def test_every_message_is_published_with_a_stance_or_travels_by_query() -> None:
    assert set(QOS_PROFILES) | BY_QUERY == set(MESSAGES)
    assert not set(QOS_PROFILES) & BY_QUERY


def test_every_stance_has_a_reason() -> None:
    for message_type, profile in QOS_PROFILES.items():
        assert len(profile.reason.split()) >= 5, message_type
        assert profile.reason.endswith("."), message_type


def test_no_stance_can_be_express_with_drop() -> None:
    assert "express" not in QosProfile._fields


def test_nothing_on_a_loop_blocks_its_sender() -> None:
    assert {profile.congestion for profile in QOS_PROFILES.values()} == {"drop"}


def test_what_moves_the_robot_goes_first_and_is_never_queued_up() -> None:
    for message_type in (Motion, Command):
        assert QOS_PROFILES[message_type].priority == "real_time"
        assert QOS_PROFILES[message_type].delivery == "keep_last"


def test_what_recognition_counts_on_comes_complete() -> None:
    for message_type in (Step, Evidence):
        assert QOS_PROFILES[message_type].delivery == "keep_all"
        assert QOS_PROFILES[message_type].reliability == "reliable"
