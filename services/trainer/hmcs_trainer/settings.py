"""Settings of the trainer."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from hmcs.bus.settings import ServiceSettings


class TrainerSettings(ServiceSettings):
    """Settings of the trainer: where models go."""

    folder: Path = Path("out/up/models")
    """Where models and their report pages are written."""
    sources: tuple[Path, ...] = ()
    """Folders, or files, beside `folder`, that recordings, CSV files and task files of a question
    may lie in. No other file is read for a question from the bus."""
    longest_s: float = Field(default=3600.0, gt=0.0)
    """A training that takes longer is given up."""
    segment_longest_s: float = Field(default=20.0, gt=0.0)
    """Finding the parts of a recording is given up when it takes longer."""
    stop_grace_s: float = Field(default=2.0, gt=0.0)
    """A training that is canceled has so long to end by itself."""
