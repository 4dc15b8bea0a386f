"""Train a model, how far the training is, and what a model finds in a recording."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from hmcs.bus.arrays import Floats
from hmcs.bus.messages.fields import Name
from hmcs.bus.messages.message import Message


class Train(Message):
    """Asks the trainer to learn a model from recordings or demonstrations."""

    SCHEMA = "train"
    VERSION = 2

    model: Name
    """What it is to be called."""
    task: str
    """Name of a task that comes along, or path of a task file, as the trainer sees it."""
    demonstrations: tuple[str, ...]
    """Recordings and CSV files, as the trainer sees them."""
    recognizer: str = ""
    """Kind of recognizer; the default one where it is empty."""
    find_states: bool = False
    """True has gestemes and states found in the motion itself, whatever labels it has: they are
    written as labels beside the recordings, and as a task of their own beside the model."""


class TrainingProgress(Message):
    """How far a training is."""

    SCHEMA = "training_progress"

    model: Name
    """What the model is to be called."""
    stage: Literal["checking", "learning", "judging", "done", "failed", "canceled"]
    """What is being done; the last three end it."""
    detail: str
    """One line: what is done now, or what came of it, or what was wrong."""
    share: Annotated[float, Field(ge=0, le=1)]
    """Of the whole that is done."""
    path: str = ""
    """Of the model file, once it is written; as the trainer sees it."""
    report: str = ""
    """Of the report page beside it."""


class SegmentQuestion(Message):
    """Asks the trainer which part of the task each moment of a whole recording was, by a model."""

    SCHEMA = "segment_question"

    recording: str
    """The recording, as the trainer sees it."""
    model: Name
    """Name of the model."""
    model_hash: Name
    """Of the model, as beliefs have it."""


class Segmentation(Message):
    """Which part of the task each moment of a recording was: the most probable segmentation."""

    SCHEMA = "segmentation"

    recording: str
    """Name of the file, without folder."""
    model: Name
    """Name of the model that it was found by."""
    begin_s: Floats
    """Where each segment begins, s since the recording's first message, rising, shape (m,)."""
    end_s: Floats
    """Where it ends, shape (m,)."""
    states: tuple[str, ...]
    """Its state, or `state/gesteme` where a state has several; empty for unknown motion; m of
    them."""
    probability: Floats
    """Mean over its steps of P(state | the whole motion), shape (m,)."""
