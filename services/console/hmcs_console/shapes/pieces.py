"""Ways in the scene: many short pieces, each in a color of its own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray


class Pieces(NamedTuple):
    """Pieces of a way."""

    segments: NDArray[np.float32]
    """Both ends of each, m, shape (n, 2, 3)."""
    colors: NDArray[np.uint8]
    """Of both ends of each, shape (n, 2, 3)."""


_NOTHING = Pieces(np.zeros((1, 2, 3), dtype=np.float32), np.zeros((1, 2, 3), dtype=np.uint8))


def add_pieces(scene: viser.SceneApi, name: str, thickness_m: float) -> viser.LineSegmentsHandle:
    """Return a way without pieces, not to be seen until `draw_pieces` gives it some."""
    # Lines that begin with one color for all are never drawn with one for each.
    return scene.add_line_segments(name, *_NOTHING, thickness=thickness_m, visible=False)


def draw_pieces(handle: viser.LineSegmentsHandle, pieces: Pieces) -> None:
    """Draw a way as it is now; one without pieces is not to be seen."""
    handle.visible = len(pieces.segments) > 0
    if len(pieces.segments):
        handle.points, handle.colors = pieces
