"""How large a message may be: checked before it is decoded, so that a refusal costs nothing.

A size bound is the largest message that an honest sender of that kind makes, times a margin. An
element is one entry of a map or of a list; the numbers of an array travel as one block of bytes
and count for nothing here.
"""

from __future__ import annotations

from typing import NamedTuple

from hmcs.bus.messages import (
    MESSAGES,
    ActivateRecognizer,
    Ask,
    Belief,
    ChangeRecording,
    Command,
    Description,
    Done,
    Evidence,
    FixtureState,
    Handle,
    Health,
    Label,
    LastSteps,
    LastStepsQuestion,
    LoadModel,
    Message,
    ModelFile,
    ModelQuestion,
    Motion,
    Outline,
    OutlineQuestion,
    Pairing,
    Record,
    Refusal,
    RobotDescription,
    RobotState,
    Segmentation,
    SegmentQuestion,
    SetLabels,
    SettingsReport,
    Step,
    StopRequest,
    Train,
    TrainingProgress,
)

KIB = 1024
MIB = 1024 * KIB

MOST_FIELDS = 256
"""Entries of one map: no message has more fields, nor a report more schemas or settings."""


class Bound(NamedTuple):
    """The largest message of one kind that is read."""

    size_bytes: int
    elements: int
    """Entries of all maps and lists together."""
    reason: str


BOUNDS: dict[type[Message], Bound] = {
    Motion: Bound(4 * KIB, 256, "Seven short arrays and three switches."),
    Command: Bound(2 * KIB, 128, "One twist: nothing that moves a robot needs more."),
    Step: Bound(4 * KIB, 256, "Four short arrays."),
    Evidence: Bound(MIB, 8192, "4000 names of gestemes, and 30 000 living pairs as four arrays."),
    Belief: Bound(256 * KIB, 8192, "4000 names of states or missing gestemes, 64 letters each."),
    FixtureState: Bound(8 * KIB, 256, "Nine short arrays and a few names."),
    Pairing: Bound(2 * KIB, 64, "Four names."),
    StopRequest: Bound(2 * KIB, 64, "A line for people."),
    RobotState: Bound(32 * KIB, 1024, "Seven short arrays, names of joints and contacts."),
    Handle: Bound(2 * KIB, 128, "One position and a name."),
    Label: Bound(2 * KIB, 64, "One name and a step."),
    TrainingProgress: Bound(32 * KIB, 64, "A line for people; no report travels in it."),
    Ask: Bound(KIB, 64, "It has no arguments."),
    Refusal: Bound(64 * KIB, 64, "A sentence, or as many as there are mistakes in a task."),
    Health: Bound(64 * KIB, 1024, "Five tables with a line for each kind of message."),
    Description: Bound(256 * KIB, 8192, "Every key of a process, and lists of its gestemes."),
    SettingsReport: Bound(256 * KIB, 8192, "A settings file."),
    LastStepsQuestion: Bound(KIB, 64, "Two numbers."),
    LastSteps: Bound(16 * MIB, 600_000, "10 000 steps, each a map of up to five arrays."),
    LoadModel: Bound(8 * KIB, 64, "One path."),
    ModelQuestion: Bound(2 * KIB, 64, "One name."),
    ModelFile: Bound(65 * MIB, 64, "A model file, 64 MB at most."),
    ActivateRecognizer: Bound(2 * KIB, 64, "One name."),
    RobotDescription: Bound(64 * MIB, 4096, "The meshes of an arm, 1 MB or so a link."),
    Record: Bound(2 * KIB, 64, "One name."),
    Train: Bound(256 * KIB, 4096, "The paths of 1000 demonstrations."),
    OutlineQuestion: Bound(2 * KIB, 64, "One name."),
    Outline: Bound(16 * MIB, 100_000, "A path of 100 000 points, and the names of all recordings."),
    ChangeRecording: Bound(16 * KIB, 64, "Two names, or a name and a note."),
    SetLabels: Bound(MIB, 20_000, "Labels of a long recording, two numbers and a name each."),
    SegmentQuestion: Bound(8 * KIB, 64, "A path, a name and a hash."),
    Segmentation: Bound(MIB, 20_000, "2000 segments, three numbers and a name each."),
    Done: Bound(64 * KIB, 64, "A sentence."),
}  # fmt: skip
"""The bound of every message."""

LARGEST_PUBLISHED_BYTES = MIB
"""No published message is larger; whatever is larger is not taken in by observers either."""

assert set(BOUNDS) == set(MESSAGES)
