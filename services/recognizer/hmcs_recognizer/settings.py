"""Settings of a recognizer in one process."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from hmcs.bus.settings import EMPTY_IS_NONE, ServiceSettings


class RecognizerSettings(ServiceSettings):
    """Settings of a recognizer in one process."""

    model: Annotated[Path | None, EMPTY_IS_NONE] = None
    """The model file to begin with; the kind of recognizer stands in it. Of a folder, the file that
    is named as `task`, unless its kind is the layered one, which gesteme classifiers and a task HMM
    run. Without one it waits to be given one."""
    task: Annotated[str | None, EMPTY_IS_NONE] = None
    """Name or file of the task whose model is taken where `model` is a folder."""
    memory_steps: int = Field(default=300, ge=1, le=10_000)
    """How many of the last steps a newcomer replays before it is ready."""
