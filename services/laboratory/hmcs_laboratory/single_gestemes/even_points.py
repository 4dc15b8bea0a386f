"""Points evenly along a motion, and its length."""

from __future__ import annotations

import numpy as np

from hmcs.arrays import Array


def evenly(positions: Array, count: int) -> Array:
    """Return `count` positions from the first to the last, evenly by index, shape (count, D).

    `positions` has shape (T, D), T of 1 at least; between two of them it is interpolated.
    """
    given = np.linspace(0.0, 1.0, len(positions))
    wanted = np.linspace(0.0, 1.0, count)
    return np.stack([np.interp(wanted, given, column) for column in positions.T], axis=1)


def length_of(positions: Array) -> float:
    """Return the length of the path through positions, shape (T, D), in their unit."""
    return float(step_lengths(positions).sum())


def step_lengths(positions: Array) -> Array:
    """Return the distances between successive positions, shape (T − 1,)."""
    return np.asarray(np.linalg.norm(np.diff(positions, axis=0), axis=1))
