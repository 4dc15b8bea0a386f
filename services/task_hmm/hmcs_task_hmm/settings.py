"""Settings of a task HMM."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from hmcs.bus.settings import ServiceSettings


class TaskFilterServiceSettings(ServiceSettings):
    """Settings of the task HMM."""

    model: Path
    """The model file."""
    deadline_ms: float = Field(default=20.0, gt=0, le=1000)
    """How long to wait for the evidence of a step before going on without what is missing."""
