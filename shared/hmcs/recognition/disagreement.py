"""Demonstrations that disagree wholly: nothing between them is what anybody meant."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.orientation_profile import mean_orientation_profile
from hmcs.motion.paths import resample
from hmcs.recognition.segments import LearningError, Segment
from hmcs.task import Task

POINTS = 32
LARGEST_DISAGREEMENT = 0.8
"""Of shapes of extent one, begun at one place; straight lines at 90° have it, opposite ones 1.15.
Drawings of one way in the LASA collection are no farther than 0.2 from each other."""

LARGEST_TURN_APART_RAD = np.pi / 2
"""Between performances, on the way: the mean of two such turns is half a right angle off from both.
Turns count as they were made: half a turn to the left is a whole one apart from half a turn to the
right."""


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


class TurnAgreement(NamedTuple):
    """Which performances of a gesteme turn the hand alike."""

    alike: tuple[int, ...]
    """Indices of the performances that agree with the one most agree with; the first of those."""
    apart_rad: Array
    """How far each performance is apart from that one, at most on the way, shape (n,)."""


def turn_agreement(segments: Sequence[Segment]) -> TurnAgreement:
    """Return which performances of one gesteme turn the hand alike; all of them tell how it turns.

    Two ways round have no mean that is one of them, even where both end in the same orientation.
    """
    turns = np.stack(
        [
            mean_orientation_profile([segment.positions], [segment.orientations], POINTS)
            for segment in segments
            if segment.orientations is not None
        ]
    )
    cosine = np.clip(np.einsum("akq,bkq->abk", turns, turns), -1.0, 1.0)
    apart_rad = 2.0 * np.arccos(cosine).max(axis=2)
    close = apart_rad <= LARGEST_TURN_APART_RAD
    chosen = int(close.sum(axis=1).argmax())
    return TurnAgreement(tuple(np.flatnonzero(close[chosen]).tolist()), apart_rad[chosen])


def _distances(motions: Sequence[Array]) -> Array:
    """Root mean square distances between motions of extent one, shape (n, n)."""
    shapes = []
    for positions in motions:
        points = resample(positions, POINTS) - positions[0]
        shapes.append(points / max(float(np.linalg.norm(points, axis=1).max()), 1e-12))
    between = np.array(shapes)[:, None] - np.array(shapes)[None]
    return np.asarray(np.sqrt((between**2).sum(axis=-1).mean(axis=-1)))
