"""Settings of a task HMM."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from hmcs.bus.settings import EMPTY_IS_NONE, ServiceSettings


class TaskFilterServiceSettings(ServiceSettings):
    """Settings of the task HMM."""

    model: Path
    """The model file; of a folder, the file that is named as `task`. A folder without it, or with a
    model of another kind than the layered one, leaves nothing to do: the process then ends."""
    task: Annotated[str | None, EMPTY_IS_NONE] = None
    """Name or file of the task whose model is taken where `model` is a folder."""
    deadline_ms: float = Field(default=20.0, gt=0, le=1000)
    """How long to wait for the evidence of a step before going on without what is missing."""
