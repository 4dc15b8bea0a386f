"""What a figure is: what the thesis shows in it, and how it is made anew."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic

import numpy as np

from hmcs_laboratory.figures.drawing import Drawn
from hmcs_laboratory.study import Settings


@dataclass(frozen=True)
class Figure(Generic[Settings]):
    """A figure of the thesis, or one that goes beyond it."""

    number: str
    """As in the thesis, e.g. `4.11`; `B.1` and so on beyond it."""
    title: str
    shows: str
    """What the thesis shows in it, and says of it."""
    draw: Callable[[Settings, np.random.Generator], Drawn]
    """Draws it with random numbers from the generator only."""
    settings: Settings
    fast: Mapping[str, Any] = field(default_factory=dict)
    """Settings to change where it is to be made fast."""
    data_of: str = ""
    """Number of the figure whose random numbers it shares, and so its data; its own where empty."""
    stand_in: str = ""
    """What stands in for data that the thesis recorded; empty where it recorded none."""

    @property
    def name(self) -> str:
        """The name of its files, without what they end in."""
        chapter, number = self.number.split(".")
        return f"figure_{chapter.lower()}_{int(number):02d}"

    def chosen(self, *, fast: bool) -> Settings:
        """Return the settings to make it with."""
        if not fast:
            return self.settings
        return type(self.settings).model_validate({**self.settings.model_dump(), **self.fast})

    def generator(self, seed: int) -> np.random.Generator:
        """Return its random numbers: the same whichever other figures are made."""
        chapter, number = (self.data_of or self.number).split(".")
        sequence = np.random.SeedSequence(seed, spawn_key=(int(chapter, 36), int(number)))
        return np.random.default_rng(sequence)
