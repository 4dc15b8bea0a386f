"""What is left of a vector once a dead band is taken off its length."""

from __future__ import annotations

import numpy as np

from hmcs.arrays import Array


def beyond(vector: Array, band: float) -> Array:
    """Return `vector`, (n,), shorter by `band`, which is not negative; zero within the band."""
    length = float(np.sqrt(vector @ vector))
    return np.asarray(vector * max(1.0 - band / length, 0.0)) if length > 0 else vector
