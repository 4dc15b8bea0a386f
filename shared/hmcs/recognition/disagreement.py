"""Demonstrations that disagree wholly: nothing between them is what anybody meant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hmcs.motion.paths import resample
from hmcs.recognition.segments import Array, LearningError, Segment
from hmcs.task import Task

POINTS = 32
LARGEST_DISAGREEMENT = 0.8
"""Of shapes of extent one, begun at one place; straight lines at 90° have it, opposite ones 1.15.
Drawings of one way in the LASA collection are no farther than 0.2 from each other."""


def check_agreement(task: Task, segments: Sequence[Segment]) -> None:
    """Raise LearningError where a performance is like no other of its gesteme.

    Each is compared, from its own beginning and whatever its size, with the others of its gesteme.
    A gesteme may be performed in several ways, as long as each was shown twice.
    """
    for index, gesteme in enumerate(task.gestemes):
        own = [segment for segment in segments if segment.gesteme == index]
        if len(own) < 2:
            continue
        apart = _distances([segment.positions for segment in own])
        np.fill_diagonal(apart, np.inf)
        nearest = apart.min(axis=1)
        worst = int(nearest.argmax())
        if nearest[worst] <= LARGEST_DISAGREEMENT:
            continue
        other = int(apart[worst].argmin())
        state = task.states[own[worst].state].name
        raise LearningError(
            f"demonstration {own[worst].demonstration!r}, state {state!r}: its gesteme "
            f"{gesteme.name!r} goes another way than anywhere else: brought to one size, it lies "
            f"{apart[worst, other]:.0%} of that from the nearest, in "
            f"{own[other].demonstration!r}. Leave out what was not meant, show each way twice, or "
            "give them gestemes of their own"
        )


def _distances(motions: Sequence[Array]) -> Array:
    """Root mean square distances between motions of extent one, shape (n, n)."""
    shapes = []
    for positions in motions:
        points = resample(positions, POINTS) - positions[0]
        shapes.append(points / max(float(np.linalg.norm(points, axis=1).max()), 1e-12))
    between = np.array(shapes)[:, None] - np.array(shapes)[None]
    return np.asarray(np.sqrt((between**2).sum(axis=-1).mean(axis=-1)))
