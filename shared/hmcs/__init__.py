"""HMCS: intent recognition and adaptive virtual fixtures for human-machine collaboration.

A *gesteme* is a motion primitive: one meaningful piece of motion. A recognizer tells, while a hand
moves, which state of a task it is in; a fixture guides a robot by it.

The names below are promised. Everything else may be imported, and may change.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hmcs.bus import messages
    from hmcs.bus.service import Service, ServiceSettings, run
    from hmcs.bus.session import Bus, BusSettings
    from hmcs.bus.step_feed import StepFeed
    from hmcs.fixtures.controller.controller import Controller
    from hmcs.fixtures.controller.interface import Guides, OperatorSample
    from hmcs.motion.demonstrations import Demonstration
    from hmcs.motion.demonstrations import read_csv as read_demonstration
    from hmcs.motion.steps import Step, steps_of
    from hmcs.recognition.learning import learn as train
    from hmcs.recognition.model import Model
    from hmcs.recognition.model_file import load_model, save_model
    from hmcs.recognition.recognizer import Recognition, Recognizer
    from hmcs.recognition.registry import recognizer_of as recognizer
    from hmcs.recordings.demonstrations import demonstrations_of
    from hmcs.recordings.reading import read as read_recording
    from hmcs.task import Task
    from hmcs.task.file import load_task

__version__ = "0.1.0"

__all__ = [
    "Bus",
    "BusSettings",
    "Controller",
    "Demonstration",
    "Guides",
    "Model",
    "OperatorSample",
    "Recognition",
    "Recognizer",
    "Service",
    "ServiceSettings",
    "Step",
    "StepFeed",
    "Task",
    "demonstrations_of",
    "load_model",
    "load_task",
    "messages",
    "read_demonstration",
    "read_recording",
    "recognizer",
    "run",
    "save_model",
    "steps_of",
    "train",
]

_WHERE = {
    "Bus": "hmcs.bus.session:Bus",
    "BusSettings": "hmcs.bus.session:BusSettings",
    "Controller": "hmcs.fixtures.controller.controller:Controller",
    "Demonstration": "hmcs.motion.demonstrations:Demonstration",
    "Guides": "hmcs.fixtures.controller.interface:Guides",
    "Model": "hmcs.recognition.model:Model",
    "OperatorSample": "hmcs.fixtures.controller.interface:OperatorSample",
    "Recognition": "hmcs.recognition.recognizer:Recognition",
    "Recognizer": "hmcs.recognition.recognizer:Recognizer",
    "Service": "hmcs.bus.service:Service",
    "ServiceSettings": "hmcs.bus.service:ServiceSettings",
    "Step": "hmcs.motion.steps:Step",
    "StepFeed": "hmcs.bus.step_feed:StepFeed",
    "Task": "hmcs.task:Task",
    "demonstrations_of": "hmcs.recordings.demonstrations:demonstrations_of",
    "load_model": "hmcs.recognition.model_file:load_model",
    "load_task": "hmcs.task.file:load_task",
    "messages": "hmcs.bus.messages",
    "read_demonstration": "hmcs.motion.demonstrations:read_csv",
    "read_recording": "hmcs.recordings.reading:read",
    "recognizer": "hmcs.recognition.registry:recognizer_of",
    "run": "hmcs.bus.service:run",
    "save_model": "hmcs.recognition.model_file:save_model",
    "steps_of": "hmcs.motion.steps:steps_of",
    "train": "hmcs.recognition.learning:learn",
}
"""Each is imported when it is first asked for: the science does not bring the wire along."""


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = _WHERE[name].partition(":")
    found = import_module(module)
    return getattr(found, attribute) if attribute else found


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
