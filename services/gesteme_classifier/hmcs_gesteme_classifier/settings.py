"""Settings of a gesteme classifier."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from hmcs.bus.settings import ServiceSettings


class GestemeClassifierSettings(ServiceSettings):
    """Settings of a gesteme classifier."""

    model: Path
    """The model file."""
    gestemes: tuple[str, ...] = ()
    """Names of the gestemes to hold; by default its share of all, divided with its peers."""
    redundancy: int = Field(default=2, ge=1)
    """How many of the peers hold each gesteme, while there are so many; equal for all peers."""
    precision: Literal["float32", "float64"] = "float32"
    """Of the evidence on the wire."""
