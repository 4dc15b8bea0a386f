"""The model that a process of the layered recognizer starts with."""

from __future__ import annotations

from pathlib import Path

from hmcs.errors import NothingToDoError
from hmcs.model_signing import signed_by
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model, model_file_of
from hmcs.recognition.registry import DEFAULT


def layered_model(place: Path, task: str | None, model_key: Path | None) -> Model:
    """Return the model in a file, or in a folder under the name of a task.

    Raises NothingToDoError where the folder has no model of the task, or one of another kind,
    which recognizer processes run; ModelFileError for a file that cannot be used.
    """
    file = model_file_of(place, task)
    if file is None:
        raise NothingToDoError(
            f"{place} holds no model of the task {task}: what is trained runs in the recognizer "
            "processes"
        )
    model = load_model(file, verify=signed_by(model_key))
    if place.is_dir() and model.recognizer != DEFAULT:
        raise NothingToDoError(
            f"{file} is for recognizers of the kind {model.recognizer!r}: it runs in the "
            "recognizer processes"
        )
    return model
