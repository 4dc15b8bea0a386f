"""Settings of a recognizer in one process."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field, field_validator

from hmcs.bus.settings import ServiceSettings


class RecognizerSettings(ServiceSettings):
    """What a recognizer in one process can be told."""

    model: Path | None = None
    """The model file to begin with; the kind of recognizer stands in it. Without one it waits to be
    given one."""
    memory_steps: int = Field(default=300, ge=1, le=10_000)
    """How many of the last steps a newcomer replays before it is ready."""

    @field_validator("model", mode="before")
    @classmethod
    def _empty_is_none(cls, model: object) -> object:
        """An environment variable that is set to nothing."""
        return None if model == "" else model
