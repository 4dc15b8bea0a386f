"""What `auto` stands for: a demonstration that is there is played, else a page moves the hand."""

from __future__ import annotations

from hmcs.task import Task
from hmcs_input_device.settings import InputDeviceSettings

AUTO = "auto"


def chosen(settings: InputDeviceSettings, task: Task) -> InputDeviceSettings:
    """Return the settings with a source in place of `auto`, and a file in place of a folder.

    A page waits for nobody.
    """
    file = settings.demonstration
    if file is not None and file.is_dir():
        file = file / f"{task.name}.csv"
        settings = settings.model_copy(update={"demonstration": file})
    if settings.source != AUTO:
        return settings
    if file is not None and file.is_file():
        return settings.model_copy(update={"source": "recorded"})
    return settings.model_copy(update={"source": "page", "demonstration": None, "wait_for": ()})
