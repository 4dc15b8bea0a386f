"""Human drawings as gestemes: the LASA shapes, one drawing of each left out."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.lasa import drawings, shapes
from hmcs_laboratory.data.gestemes import GestemeSet


def equal_steps(positions: Array, step_m: float) -> Array:
    """Return the points at every `step_m` of a path's length, m, shape (T, D), from the first.

    Raises ValueError for a path not two steps long.
    """
    lengths = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(lengths)])
    wanted = np.arange(0.0, travelled[-1], step_m)
    if len(wanted) < 3:
        raise ValueError(f"a path of {travelled[-1]:g} m is not two steps of {step_m:g} m long")
    return np.stack([np.interp(wanted, travelled, column) for column in positions.T], axis=1)


@cache
def resampled(shape: str, step_m: float) -> tuple[Array, ...]:
    """Return all drawings of a shape in equal steps, m on the tablet, each of shape (T, 2)."""
    return tuple(equal_steps(drawing.positions, step_m) for drawing in drawings(shape))


def left_out(
    step_m: float,
    training: int,
    rng: np.random.Generator,
    *,
    names: Sequence[str] | None = None,
) -> GestemeSet:
    """Return the shapes with one drawing of each, drawn by lot, left out of training.

    `training` others of each are there to learn from.
    Raises ValueError unless there are so many.
    """
    taught, tested = [], []
    for name in names or shapes():
        own = resampled(name, step_m)
        if not 1 <= training < len(own):
            raise ValueError(f"training is {training}, expected 1 to {len(own) - 1}")
        order = rng.permutation(len(own))
        tested.append((own[order[0]],))
        taught.append(tuple(own[k] for k in order[1 : training + 1]))
    return GestemeSet(tuple(taught), tuple(tested))
