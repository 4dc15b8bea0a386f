"""What travels: every message of the protocol, a file for each part of the system.

A message is a frozen pydantic model of its body alone. On the wire it is one msgpack map: the
fields of the body beside those of its `Envelope` (`schema`, `source`, `seq`, `origin`). Unknown
fields are ignored on reading (a newer peer sent them); missing, mistyped, misshapen or non-finite
ones are refused.

Conventions (REP 103, REP 105): SI units; right-handed frames, x forward, z up; quaternions
x y z w; twists and wrenches linear part first; poses in the robot's base frame unless a field says
otherwise; times in nanoseconds. The *operator frame* is the one hand positions are measured in:
its axes are parallel to the robot's base axes, its zero is the device's own.

`t` is the index of a step. Step t is the motion from x_t to x_{t+1}; a segment that starts at s has
step s as its first and x_s as its origin.
"""

from __future__ import annotations

from hmcs.bus.messages.fixture import ActivateRecognizer, Command, FixtureState, Pairing
from hmcs.bus.messages.message import Envelope, Message, Origin, Source
from hmcs.bus.messages.operator import Handle, Motion
from hmcs.bus.messages.process import Ask, Description, Done, Health, Refusal, SettingsReport
from hmcs.bus.messages.recognition import (
    Belief,
    Evidence,
    LoadModel,
    ModelFile,
    ModelQuestion,
)
from hmcs.bus.messages.recording import (
    ChangeRecording,
    Label,
    Outline,
    OutlineQuestion,
    Record,
    SetLabels,
)
from hmcs.bus.messages.robot import RobotDescription, RobotState, StopRequest
from hmcs.bus.messages.steps import LastSteps, LastStepsQuestion, Step
from hmcs.bus.messages.training import (
    Segmentation,
    SegmentQuestion,
    Train,
    TrainingProgress,
)

__all__ = [
    "MESSAGES",
    "ActivateRecognizer",
    "Ask",
    "Belief",
    "ChangeRecording",
    "Command",
    "Description",
    "Done",
    "Envelope",
    "Evidence",
    "FixtureState",
    "Handle",
    "Health",
    "Label",
    "LastSteps",
    "LastStepsQuestion",
    "LoadModel",
    "Message",
    "ModelFile",
    "ModelQuestion",
    "Motion",
    "Origin",
    "Outline",
    "OutlineQuestion",
    "Pairing",
    "Record",
    "Refusal",
    "RobotDescription",
    "RobotState",
    "SegmentQuestion",
    "Segmentation",
    "SetLabels",
    "SettingsReport",
    "Source",
    "Step",
    "StopRequest",
    "Train",
    "TrainingProgress",
]

MESSAGES: tuple[type[Message], ...] = (
    Motion,
    Step,
    Evidence,
    Belief,
    Command,
    FixtureState,
    Pairing,
    StopRequest,
    RobotState,
    Handle,
    Label,
    TrainingProgress,
    Ask,
    Refusal,
    Health,
    Description,
    SettingsReport,
    LastStepsQuestion,
    LastSteps,
    LoadModel,
    ModelQuestion,
    ModelFile,
    ActivateRecognizer,
    RobotDescription,
    Record,
    Train,
    OutlineQuestion,
    Outline,
    SetLabels,
    ChangeRecording,
    SegmentQuestion,
    Segmentation,
    Done,
)
"""Every message there is, for schemas, golden bytes and tables."""
