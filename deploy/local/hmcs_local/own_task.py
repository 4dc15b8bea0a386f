"""What of compose.yaml runs for a task of one's own, and with which settings.

The stack of compose.yaml teaches and plays its own demo. For another task that part is left out:
a hand at the page, or another source, moves the robot, and a model of the task is run where there
is one. Without a model the recognizer process waits for what is trained on the page.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from hmcs.errors import UserError
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model
from hmcs.recognition.registry import DEFAULT
from hmcs.task import Task, shipped_tasks
from hmcs_local.compose import StackSpec
from hmcs_local.stack import LAYERED

PAGE = "page"
PLAYED = ("synthetic", "simulated")
"""Sources that are moved by a model's learned paths."""
RECORDED = "recorded"
_DEMO_ALONE = ("teach", *LAYERED)

Environment = Mapping[str, Mapping[str, str | None]]


class OwnTask(NamedTuple):
    """A task that the stack is brought up for."""

    place: str
    """The task's name where it comes along, else the absolute path of its file."""
    model: Path | None = None
    """What recognizes it from the start."""
    layered: bool = False
    """Whether that model is of the default kind, which is spread over processes."""
    source: str = PAGE
    """Of the input device."""
    demonstration: Path | None = None
    """What the source `recorded` plays."""


class Arrangement(NamedTuple):
    """Which services run, and what is different in the environment of each."""

    services: tuple[str, ...]
    environment: Environment


def own_task(
    name: str, task: Task, *, model: Path | None, source: str, demonstrations: Sequence[str]
) -> OwnTask:
    """Return the task to bring the stack up for; `name` is a shipped one's, or its file.

    Raises ModelFileError for a model that cannot be read, and UserError for one of another task and
    a source that has nothing to play.
    """
    place = name if name in shipped_tasks() else str(Path(name).resolve())
    played = next((Path(each) for each in demonstrations if each.endswith(".csv")), None)
    if source == RECORDED and played is None:
        raise UserError(f"--source {RECORDED}: give the CSV file to play as a demonstration")
    layered = False
    if model is not None:
        read = load_model(model)
        _check_is_of(read, model, task)
        layered = read.recognizer == DEFAULT
    return OwnTask(place, model, layered, source, played)


def arranged(own: OwnTask, spec: StackSpec, models: Path, recordings: Path) -> Arrangement:
    """Return how the stack of compose.yaml runs for a task; models and recordings are folders."""
    left_out = {"teach"} if own.layered else set(_DEMO_ALONE)
    model = None if own.model is None else str(own.model.resolve())
    file = [own.place] if Path(own.place).is_absolute() else []
    changed: dict[str, dict[str, str | None]] = {
        "input-device": input_environment(own.source, model, own.demonstration),
        "gesteme-classifier": {"HMCS_MODEL": model},
        "task-hmm": {"HMCS_MODEL": model},
        "recognizer": {"HMCS_MODEL": None if own.layered else model},
        "fixture-controller": {"HMCS_MODELS": json.dumps([model] if model else [])},
        "console": {"HMCS_MODELS": json.dumps(_folders(models, model))},
        "trainer": {"HMCS_SOURCES": json.dumps([str(recordings), *file])},
        "recorder": {"HMCS_MODELS": json.dumps(_folders(models, model))},
    }
    return Arrangement(
        tuple(name for name in spec.usual if name not in left_out),
        {name: changed.get(name, {}) | {"HMCS_TASK": own.place} for name in spec.services},
    )


def input_environment(
    source: str, model: str | None, demonstration: Path | None
) -> dict[str, str | None]:
    """Return what makes the input device of compose.yaml one with another source.

    Raises UserError for a source that has no model whose paths it could follow.
    """
    if source in PLAYED and model is None:
        raise UserError(
            f"--source {source}: it follows the learned paths of a model: give --model FILE, or "
            "demonstrations to learn one from"
        )
    plays = source in (*PLAYED, RECORDED)
    played = str(demonstration.resolve()) if source == RECORDED and demonstration else None
    return {
        "HMCS_SOURCE": source,
        "HMCS_MODEL": model if source in PLAYED else None,
        "HMCS_DEMONSTRATION": played,
        "HMCS_WAIT_FOR": json.dumps(["fixture_controller", "robot"] if plays else []),
        **({} if plays else dict.fromkeys(("HMCS_RATE_HZ", "HMCS_REPEAT", "HMCS_RE_ENGAGE"))),
        **({"HMCS_REPEAT": None, "HMCS_RE_ENGAGE": None} if source == "simulated" else {}),
    }


def unheard(environment: Mapping[str, str], heard: frozenset[str]) -> list[str]:
    """Return the HMCS_* variables of an environment that compose.yaml gives to nobody."""
    return sorted(name for name in environment if name.startswith("HMCS_") and name not in heard)


def _folders(models: Path, model: str | None) -> list[str]:
    outside = model is not None and Path(model).parent != models
    return [str(models), *([model] if model is not None and outside else [])]


def _check_is_of(model: Model, file: Path, task: Task) -> None:
    if model.task.name != task.name:
        raise UserError(
            f"--model {file}: it is of the task {model.task.name!r}, not of {task.name!r}: give a "
            "model of this task, or its own task"
        )
