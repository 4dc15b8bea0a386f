"""Trails: where something has been, in pieces, each in the color of what was recognized there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hmcs_console.shapes.palette import Color
from hmcs_console.shapes.pieces import Pieces

Points = NDArray[np.float64]


class Trail:
    """Keeps the newest `longest` pieces of a way, none of them shorter than `spacing_m`."""

    def __init__(self, longest: int = 600, spacing_m: float = 0.002) -> None:
        self._segments = np.zeros((longest, 2, 3), dtype=np.float32)
        self._colors = np.zeros((longest, 2, 3), dtype=np.uint8)
        self._count = 0
        self._spacing_m = spacing_m
        self._last: Points | None = None
        self._pieces: Pieces | None = None

    def add(self, point: Points, color: Color) -> None:
        """Go on to a point, m, shape (3,); too near the last one it is left out."""
        if self._last is None:
            self._last = point
        elif float(np.linalg.norm(point - self._last)) >= self._spacing_m:
            if self._count == len(self._segments):
                self._segments[:-1] = self._segments[1:]
                self._colors[:-1] = self._colors[1:]
                self._count -= 1
            self._segments[self._count] = self._last, point
            self._colors[self._count] = color
            self._count += 1
            self._last = point
            self._pieces = None

    def lift(self) -> None:
        """Go on elsewhere, without a piece that leads there."""
        self._last = None

    @property
    def pieces(self) -> Pieces:
        """The pieces, oldest first; the very same as long as there are no more."""
        if self._pieces is None:
            kept = slice(0, self._count)
            self._pieces = Pieces(self._segments[kept].copy(), self._colors[kept].copy())
        return self._pieces
