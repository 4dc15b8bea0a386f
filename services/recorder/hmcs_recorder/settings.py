"""Settings of the recorder."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from hmcs.bus.settings import ServiceSettings


class RecorderSettings(ServiceSettings):
    """Settings of the recorder: where recordings go, and how large they grow."""

    folder: Path = Path("out/recordings")
    """Where recordings are written; made where it is missing."""
    autostart: bool = True
    """Record from the start; otherwise only when asked to `record`."""
    models: tuple[Path, ...] = ()
    """Model files, or folders of `*.hmcs` files, that are kept with each recording: who has one can
    replay it."""
    part_mb: float = Field(default=512.0, gt=0.0)
    """A recording goes on in a new file once one is so large..."""
    part_s: float = Field(default=3600.0, gt=0.0)
    """...or so long."""
    limit_mb: float = Field(default=8192.0, gt=0.0)
    """So much in the folder at most: then recording ends. Nothing is ever deleted."""
    free_mb: float = Field(default=256.0, ge=0.0)
    """So much of the disk is left to others."""
    flush_s: float = Field(default=0.5, gt=0.0, le=60.0)
    """What came longer ago than this outlives an end by kill -9."""
    outline_mb: float = Field(default=64.0, gt=0.0)
    """Recordings up to so large are read for the page, to set labels by; reading larger ones would
    take too long."""
