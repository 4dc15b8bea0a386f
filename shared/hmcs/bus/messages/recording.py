"""Recordings: begin and end one, label the motion, show it and set labels afterwards."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hmcs.bus.arrays import LARGEST, Floats, Points
from hmcs.bus.messages.fields import Count, Within
from hmcs.bus.messages.message import Message


class Record(Message):
    """Asks the recorder to begin or to end a recording."""

    SCHEMA = "record"

    on: bool
    """True begins one, False ends it."""
    name: str = ""
    """Of the file; by date and time where it is empty."""


class Label(Message):
    """The operator says in which state of the task the hand is from now on."""

    SCHEMA = "label"

    state: str
    """A task state, or `state/gesteme` where a state has several; empty ends what was labeled."""
    clock: str = ""
    """Boot of the input device whose steps are meant; empty where none was heard of."""
    step: Count = 0
    """The first step the label is true of."""


class OutlineQuestion(Message):
    """Asks the recorder for the motion in a recording, to set labels by."""

    SCHEMA = "outline_question"

    recording: str = ""
    """Name of the file, without folder; the newest one where it is empty."""


class Outline(Message):
    """The motion in a recording, and which part of the task it was."""

    SCHEMA = "outline"
    VERSION = 2

    recordings: tuple[str, ...]
    """Names of all files in the folder, the newest first."""
    recording: str
    """Name of the file this is the outline of."""
    path: str
    """Of that file, as the recorder sees it."""
    duration_s: Annotated[float, Field(ge=0), Within(LARGEST)]
    """From its first message to its last."""
    time_s: Floats
    """Since its first message, rising, shape (n,)."""
    position: Points
    """Of the hand, m, operator frame, shape (n, 3)."""
    begin_s: Floats
    """Where each label begins, s since the first message, shape (m,)."""
    end_s: Floats
    """Where it ends, shape (m,)."""
    states: tuple[str, ...]
    """What it says, as in Label, m of them."""
    note: str = ""
    """What somebody wrote down about the recording."""


class SetLabels(Message):
    """Asks the recorder to write labels beside a recording, instead of those there are."""

    SCHEMA = "set_labels"

    recording: str
    """Name of the file, without folder."""
    begin_s: Floats
    """Where each label begins, s since the recording's first message, shape (m,)."""
    end_s: Floats
    """Where it ends, shape (m,)."""
    states: tuple[str, ...]
    """What it says, as in Label, m of them."""


class ChangeRecording(Message):
    """Asks the recorder to rename a recording, to delete it, or to note something about it."""

    SCHEMA = "change_recording"

    recording: str
    """Name of the file, without folder."""
    change: Literal["rename", "delete", "note"]
    """What to do: its labels and its note go along."""
    text: str = ""
    """The new name, without folder and ending, or the note; an empty note takes it away."""
