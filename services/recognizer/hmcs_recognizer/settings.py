"""Settings of a recognizer in one process."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from hmcs.bus.settings import ServiceSettings


class RecognizerSettings(ServiceSettings):
    """What a recognizer in one process can be told."""

    model: Path
    """The model file; the kind of recognizer stands in it."""
    memory_steps: int = Field(default=300, ge=1, le=10_000)
    """How many of the last steps a newcomer replays before it is ready."""
