"""Demonstrations as they are compared when nobody labeled them: checked, and in equal steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.discovery.consensus import equal_steps
from hmcs.recognition.discovery.stops import dwells
from hmcs.recognition.segments import LearningError

Integers = NDArray[np.int64]


class UnlabeledDemo(NamedTuple):
    """What is looked at of a demonstration."""

    name: str
    positions: Array
    """m, shape (S, 3)."""
    time_s: Array | None
    """Shape (S,), rising; None where it is not known."""

    def same(self, other: UnlabeledDemo) -> bool:
        """Return whether the other was made by the very same hand at the same places."""
        return np.array_equal(self.positions, other.positions)


class ResampledDemo(NamedTuple):
    """A motion in equal steps."""

    points: Array
    """m, shape (T, 3)."""
    at_sample: Array
    """Where between the samples each point lies, with fractions, shape (T,)."""
    dwell: Array | None
    """How long each step takes, in median steps, shape (T − 1,); None where no times
    are known."""

    def samples(self, at: Array) -> Integers:
        """Return the samples next to points, given as indices with fractions, rising.

        No two are the same, and none is the first or the last sample.
        """
        here = np.arange(len(self.at_sample))
        return rising(np.interp(at, here, self.at_sample), round(self.at_sample[-1]))


def checked_demos(demonstrations: Sequence[Demonstration | ArrayLike]) -> list[UnlabeledDemo]:
    """Return what may be looked at of each demonstration.

    Raises LearningError when there is none, or one has not positions of shape (T, 3), or fewer than
    two, or one that is not finite, or never moves.
    """
    if not len(demonstrations):
        raise LearningError("no demonstrations to find gestemes in: give at least one")
    demos = []
    for number, given in enumerate(demonstrations, start=1):
        if isinstance(given, Demonstration):
            demo = UnlabeledDemo(given.name, np.asarray(given.positions, float), given.time_s)
        else:
            demo = UnlabeledDemo(f"demonstration {number}", np.asarray(given, dtype=float), None)
        _check(demo)
        demos.append(demo)
    return demos


def rising(at: Array, last: int) -> Integers:
    """Return the whole numbers nearest to rising ones, from 1 to last − 1, no two the same.

    Raises LearningError where there are not so many numbers.
    """
    count = len(at)
    if count > last - 1:
        raise LearningError(
            f"{last + 1} samples are too few for {count + 1} pieces: record more densely"
        )
    # Numbers that rise by one at least are their index plus numbers that do not fall.
    index = np.arange(count)
    near = np.maximum.accumulate(np.rint(at).astype(np.int64) - index)
    return np.asarray(np.clip(near, 1, last - count) + index)


def common_step_m(demos: Sequence[UnlabeledDemo], least_m: float, most_steps: int) -> float:
    """Return the length of step that suits all, m: the median distance between samples.

    It is `least_m` where that is longer, and longer still where the longest motion would have more
    than `most_steps`.
    """
    moves = [np.linalg.norm(np.diff(demo.positions, axis=0), axis=1) for demo in demos]
    moved = np.concatenate(moves)
    longest_m = max(float(own.sum()) for own in moves)
    return max(least_m, float(np.median(moved[moved > 0])), longest_m / most_steps)


def resampled(demo: UnlabeledDemo, step_m: float, shortest_steps: int) -> ResampledDemo:
    """Return a motion in equal steps; raises LearningError when it has too few of them."""
    points, index = equal_steps(demo.positions, step_m)
    steps = len(points) - 1
    if steps < shortest_steps:
        raise LearningError(
            f"{demo.name!r} makes {steps} step(s) of {step_m:.4g} m, but a piece has "
            f"{shortest_steps} at least: demonstrate it larger, or leave it out"
        )
    dwell = None if demo.time_s is None else dwells(demo.time_s, index)
    return ResampledDemo(points, index, dwell)


def _check(demo: UnlabeledDemo) -> None:
    positions = demo.positions
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise LearningError(
            f"{demo.name!r} has positions of shape {positions.shape}, expected (T, 3): give x, y "
            "and z in m, z = 0 for motion in a plane"
        )
    if len(positions) < 2:
        raise LearningError(
            f"{demo.name!r} has {len(positions)} sample(s), expected two at least: leave it out"
        )
    if not np.isfinite(positions).all():
        first = int((~np.isfinite(positions).all(axis=1)).argmax())
        raise LearningError(
            f"{demo.name!r}: position {first} is {positions[first].tolist()}, expected finite "
            "numbers: mend the recording or cut that part out"
        )
    if not np.ptp(positions, axis=0).any():
        raise LearningError(
            f"{demo.name!r} never moves: all its positions are the same; leave it out"
        )
