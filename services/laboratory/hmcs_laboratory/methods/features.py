"""What feature-based peers see of a motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs_laboratory.single_gestemes.even_points import evenly


def directions(positions: Array) -> Array:
    """Return the unit directions between successive positions, shape (T − 1, D); 0 at rest."""
    moves = np.diff(positions, axis=0)
    lengths = np.linalg.norm(moves, axis=1, keepdims=True)
    return np.asarray(moves / np.where(lengths > 0, lengths, 1.0))


def shape_and_length(positions: Array, count: int = 12) -> Array:
    """Return the displacements from the start of points evenly along, and the log of the length.

    Shape (count · D + 1,); the length is the number of steps.
    """
    points = evenly(positions - positions[0], count)
    return np.append(points.ravel(), np.log(len(positions) - 1))


def labels(examples: Sequence[Sequence[Array]]) -> NDArray[np.int64]:
    """Return the gesteme of each example, gesteme by gesteme, shape (n,)."""
    return np.repeat(np.arange(len(examples)), [len(own) for own in examples])


def flat(examples: Sequence[Sequence[Array]]) -> list[Array]:
    """Return all examples, gesteme by gesteme."""
    return [positions for own in examples for positions in own]
