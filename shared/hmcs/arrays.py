"""The one kind of array that the science works on; shapes stand where it is used."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Numbers in double precision."""


def shortened(vector: Array, length: float) -> Array:
    """Return `vector` cut to `length` at most, in its direction, however large it is."""
    largest = float(np.abs(vector).max())
    if largest == 0.0:
        return vector
    shape = vector / largest
    norm = float(np.linalg.norm(shape))
    if largest <= length / norm:
        return vector
    cut: Array = shape * (length / norm)
    return cut
