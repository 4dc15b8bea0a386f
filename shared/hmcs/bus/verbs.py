"""What can be asked: one table of every question between processes, with its answer.

`STOP.ask(bus, Ask(), instance="robot-1")` asks; `STOP.answer(bus, handler)` answers. Nothing else
names a verb.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

from hmcs.bus.keys import ANY
from hmcs.bus.messages import (
    ActivateRecognizer,
    Ask,
    ChangeRecording,
    Description,
    Done,
    Health,
    LastSteps,
    LastStepsQuestion,
    LoadModel,
    Message,
    ModelFile,
    ModelQuestion,
    Outline,
    OutlineQuestion,
    Record,
    RobotDescription,
    Segmentation,
    SegmentQuestion,
    SetLabels,
    SettingsReport,
    Train,
)

if TYPE_CHECKING:
    from hmcs.bus.session import Answer, Bus

Q = TypeVar("Q", bound=Message)
A = TypeVar("A", bound=Message)


@dataclass(frozen=True)
class Verb(Generic[Q, A]):
    """One question that processes of some kinds answer."""

    name: str
    """The last chunk of its key."""
    services: tuple[str, ...]
    """The kinds of process that answer it; none named: every process."""
    question: type[Q]
    reply: type[A]
    purpose: str
    """What it does or tells, in one line."""

    def ask(
        self,
        bus: Bus,
        question: Q,
        *,
        service: str | None = None,
        instance: str = ANY,
        timeout_s: float = 1.0,
    ) -> list[Answer[A]]:
        """Return the answers that came within `timeout_s`; see `Bus.ask` for what it raises.

        `service` is needed only where several kinds answer; by default all of them are asked.
        """
        key = bus.keys.rpc(service or self._asked(), instance, self.name)
        return bus.ask(key, question, self.reply, timeout_s=timeout_s)

    def answer(self, bus: Bus, handler: Callable[[Q], A], *, aside: Executor | None = None) -> None:
        """Answer it with what `handler` returns; see `Bus.answer` for `aside`."""
        bus.answer(self.name, self.question, handler, aside=aside)

    def _asked(self) -> str:
        return self.services[0] if len(self.services) == 1 else ANY


HEALTH = Verb("health", (), Ask, Health, "how it is, and what it counted")
DESCRIBE = Verb("describe", (), Ask, Description, "what it says, hears and answers, and its facts")
SETTINGS = Verb("settings", (), Ask, SettingsReport, "the settings in force")
LAST_STEPS = Verb(
    "last_steps", ("input_device",), LastStepsQuestion, LastSteps, "the last steps, once more"
)
PLAY = Verb("play", ("input_device",), Ask, Done, "begins to play, or goes on after a stop")
LOAD_MODEL = Verb(
    "load_model", ("recognizer", "fixture_controller"), LoadModel, Done, "works with a model file"
)
MODEL_FILE = Verb(
    "model_file", ("fixture_controller",), ModelQuestion, ModelFile, "the file of a loaded model"
)
ACTIVATE = Verb(
    "activate", ("fixture_controller",), ActivateRecognizer, Done, "follows that recognizer"
)
LOOKS = Verb("looks", ("robot",), Ask, RobotDescription, "what is needed to draw the robot")
STOP = Verb("stop", ("robot",), Ask, Done, "stands until the operator lets go and takes hold again")
RECORD = Verb("record", ("recorder",), Record, Done, "begins or ends a recording")
OUTLINE = Verb("outline", ("recorder",), OutlineQuestion, Outline, "the motion in a recording")
SET_LABELS = Verb("set_labels", ("recorder",), SetLabels, Done, "writes labels for a recording")
CHANGE_RECORDING = Verb(
    "change_recording",
    ("recorder",),
    ChangeRecording,
    Done,
    "renames or deletes a recording, or notes something about it",
)
TRAIN = Verb("train", ("trainer",), Train, Done, "learns a model")
CANCEL = Verb("cancel", ("trainer",), Ask, Done, "ends the training that runs")
SEGMENT = Verb(
    "segment",
    ("trainer",),
    SegmentQuestion,
    Segmentation,
    "the parts of the task in a recording, found afterwards by a model",
)

VERBS: tuple[Verb, ...] = (  # type: ignore[type-arg]
    HEALTH,
    DESCRIBE,
    SETTINGS,
    LAST_STEPS,
    PLAY,
    LOAD_MODEL,
    MODEL_FILE,
    ACTIVATE,
    LOOKS,
    STOP,
    RECORD,
    OUTLINE,
    SET_LABELS,
    CHANGE_RECORDING,
    TRAIN,
    CANCEL,
    SEGMENT,
)
"""Every verb there is."""


def verbs_of(service: str) -> tuple[Verb, ...]:  # type: ignore[type-arg]
    """Return what processes of a kind answer."""
    return tuple(verb for verb in VERBS if not verb.services or service in verb.services)
