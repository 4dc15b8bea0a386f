"""Motions as vectors of fixed length, and how vectors of a gesteme vary where only one is known.

Shapes: D axes, n motions, C points evenly along a motion, its start left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs_laboratory.single_gestemes.closed_loop import unit
from hmcs_laboratory.single_gestemes.even_points import evenly, step_lengths


class HandSettings(NamedTuple):
    """How performances of one gesteme are expected to differ where none was performed twice."""

    size: float = 0.1
    """Standard deviation of the size, as a share."""
    turn_rad: float = 0.1
    """Of the turn, about any axis."""
    drift: float = 0.03
    """Of the place at the end, as a share of the length, beside size and turn."""
    log_length: float = 0.15
    """Of the logarithm of the number of steps."""
    place_per_roughness: float = 3.0
    """Of the place, in steps, for a path as rough as a step is long."""
    progress_per_roughness: float = 6.0
    """Of the progress along the path after one step, in steps, for the same; it grows with the
    square root of the number of steps."""
    memory_steps: float = 4.0
    """How long the hand stays beside its path."""


def whole_vector(positions: Array, points: int) -> Array:
    """Return C points from the start, and the log of the number of steps, shape (C·D + 1,).

    `positions` has shape (T, D), T of 2 at least.
    """
    return np.append(_points(positions, points), np.log(len(positions) - 1))


def beginning_vector(positions: Array, steps: int, points: int) -> Array:
    """Return C points of the first so many steps, from the start, shape (C·D,).

    A motion that is over before stays where it ended.
    """
    part = positions[: steps + 1]
    missing = steps + 1 - len(part)
    return _points(np.pad(part, ((0, missing), (0, 0)), mode="edge"), points)


def roughness(motions: Sequence[Array]) -> float:
    """Return by how much directions differ from smooth ones: the standard deviation an axis.

    From the second differences of unit directions of motions, shape (T, D) each; steps backwards
    do not count as turns. 0 where none has four steps.
    """
    squares = [np.zeros(0)]
    for positions in motions:
        direction = unit(np.diff(positions, axis=0))
        if len(direction) < 4:
            continue
        back = (direction[1:] * direction[:-1]).sum(axis=1) < 0
        turn = direction[1:] - np.where(back[:, None], -1.0, 1.0) * direction[:-1]
        squares.append((np.diff(turn, axis=0) ** 2).mean(axis=1))
    # Independent errors of directions make second differences six times as large in square.
    every = np.concatenate(squares)
    return float(np.sqrt(every.mean() / 6.0)) if len(every) else 0.0


def expected_covariance(
    motions: Sequence[Array], points: int, settings: HandSettings, *, whole: bool
) -> Array:
    """Return the covariance of vectors of one gesteme that hands are expected to have.

    Size, turn and progress along the path vary, as the mean over the motions given, shape (T, D)
    each; the hand drifts, and strays from its path by how rough the motions are. Shape (F, F),
    F = C·D of beginnings and one more of whole motions, whose progress ends where it is over.
    """
    rough = roughness(motions)
    step = float(np.mean(np.concatenate([step_lengths(positions) for positions in motions])))
    steps = float(np.mean([len(positions) - 1 for positions in motions]))
    dimensions = motions[0].shape[1]
    share = np.arange(1, points + 1) / points
    earlier = np.minimum.outer(share, share)
    apart = steps * np.abs(np.subtract.outer(share, share))
    memory = settings.memory_steps
    beside = np.exp(-apart / memory) * np.minimum(steps * earlier / memory, 1.0)
    place = (settings.drift * steps * step) ** 2 * earlier
    place = place + (settings.place_per_roughness * rough * step) ** 2 * beside
    covariance = np.kron(place, np.eye(dimensions))
    progress = earlier - np.outer(share, share) if whole else earlier
    progress = (settings.progress_per_roughness * rough) ** 2 / steps * progress
    for positions in motions:
        covariance += _of_motion(positions, points, progress, settings) / len(motions)
    if not whole:
        return covariance
    covariance = np.pad(covariance, ((0, 1), (0, 1)))
    covariance[-1, -1] = (
        settings.log_length**2 + (settings.progress_per_roughness * rough) ** 2 / steps
    )
    return covariance


def _of_motion(positions: Array, points: int, progress: Array, settings: HandSettings) -> Array:
    """What size, turn and progress along its path add, shape (C·D, C·D)."""
    places = _points(positions, points).reshape(points, -1)
    dimensions = places.shape[1]
    speed = np.gradient(np.vstack([np.zeros(dimensions), places]), 1.0 / points, axis=0)[1:]
    warped = progress[:, None, :, None] * speed[:, :, None, None] * speed[None, None]
    flat = places.ravel()
    added = warped.reshape(len(flat), len(flat)) + settings.size**2 * np.outer(flat, flat)
    for a in range(dimensions):
        for b in range(a):
            turned = np.zeros_like(places)
            turned[:, a], turned[:, b] = -places[:, b], places[:, a]
            added += settings.turn_rad**2 * np.outer(turned.ravel(), turned.ravel())
    return np.asarray(added)


def _points(positions: Array, points: int) -> Array:
    return np.asarray(evenly(positions - positions[0], points + 1)[1:].ravel())
