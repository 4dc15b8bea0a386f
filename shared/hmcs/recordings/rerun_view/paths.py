"""Ways of hand and tool as lines, a piece for each stretch in one state, in the state's color."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hmcs.recordings.rerun_view.rows import listed

RADIUS_M = 0.001
EVERY_NS = 33_000_000
"""A way has one point in such a time."""


class ColoredPath:
    """One way, in pieces."""

    def __init__(self) -> None:
        self.pieces: list[list[list[float]]] = []
        """m, each at least one point."""
        self.colors: list[str] = []
        self._grown_ns = -EVERY_NS
        self._interrupted = True

    def add(self, position: Any, color: str, log_ns: int) -> None:
        """Add where it was, m, shape (3,), in a state of this color."""
        begins = self._interrupted or self.colors[-1] != color
        if not begins and log_ns - self._grown_ns < EVERY_NS:
            return
        point = [*listed(position)]
        if begins:
            joined = [] if self._interrupted else [self.pieces[-1][-1]]
            self.pieces.append(joined)
            self.colors.append(color)
        self.pieces[-1].append(point)
        self._interrupted, self._grown_ns = False, log_ns

    def interrupt(self) -> None:
        """Begin a new piece with the next point, e.g. since the hand is put elsewhere."""
        self._interrupted = True

    def lines(self) -> Any:
        """Return it as Rerun's `LineStrips3D`; pieces of one point are left out."""
        import rerun as rr

        shown = [
            (piece, color)
            for piece, color in zip(self.pieces, self.colors, strict=True)
            if len(piece) > 1
        ]
        return rr.LineStrips3D(
            [piece for piece, _ in shown],
            colors=color_numbers([color for _, color in shown]),
            radii=RADIUS_M,
        )


def color_numbers(colors: Sequence[str]) -> NDArray[np.uint32]:
    """Return colors, `#rrggbb` each, as Rerun writes them, 0xRRGGBBAA."""
    return np.array([int(color.removeprefix("#") + "ff", 16) for color in colors], dtype=np.uint32)
