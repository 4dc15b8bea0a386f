"""Settings of a gesteme classifier."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from hmcs.bus.settings import EMPTY_IS_NONE, ServiceSettings


class GestemeClassifierSettings(ServiceSettings):
    """Settings of a gesteme classifier."""

    model: Path
    """The model file; of a folder, the file that is named as `task`. A folder without it, or with a
    model of another kind than the layered one, leaves nothing to do: the process then ends."""
    task: Annotated[str | None, EMPTY_IS_NONE] = None
    """Name or file of the task whose model is taken where `model` is a folder."""
    gestemes: tuple[str, ...] = ()
    """Names of the gestemes to hold; by default its share of all, divided with its peers."""
    redundancy: int = Field(default=2, ge=1)
    """How many of the peers hold each gesteme, while there are so many; equal for all peers."""
    precision: Literal["float32", "float64"] = "float32"
    """Of the evidence on the wire."""
