"""Simulated operators: the synthetic hand of the thesis (3.1.5, 4.2).

A hand runs along a reference trajectory, always aiming at a point of it beyond the look-ahead
distance, and errs in direction and in the length of its steps, both by κ (3.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.paths import Path


class OperatorStuckError(RuntimeError):
    """The simulated hand did not reach the end of its reference; its noise is too large."""


@dataclass(frozen=True)
class Operator:
    """How a simulated hand moves.

    Raises ValueError for a length that is not positive, or noise below zero.
    """

    step_m: float = 0.05
    """δ: mean length of a step, m."""
    noise: float = 0.15
    """κ of (3.3). Above 0.7 the hand may never arrive (thesis, 4.2.1)."""
    look_ahead_m: float = 0.15
    """ξ of 3.1.5: the point aimed at is farther than this, m."""
    renormalize: bool = True
    """Whether the direction is a unit vector again after the error is added to it, so that only
    δ(1 + 2κΓ) sets the step's length. Left open in the thesis."""
    stop_within_steps: float = 2.0
    """The hand stops once it aims at the end and is within so many steps of it. Left open in the
    thesis."""
    most_steps: float = 50.0
    """It gives up after so many times the steps that the reference is long."""

    def __post_init__(self) -> None:
        for name in ("step_m", "look_ahead_m", "stop_within_steps", "most_steps"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} is {getattr(self, name)}, expected more than 0")
        if not self.noise >= 0:
            raise ValueError(f"noise is {self.noise}, expected 0 or more")


class Trace(NamedTuple):
    """A motion that a simulated hand made."""

    positions: Array
    """m, shape (T, D)."""
    segments: NDArray[np.intp]
    """Index of the segment of the reference that each position lies on, shape (T,), never
    falling."""


class TaskSegment(NamedTuple):
    """One piece of a task to be performed."""

    state: str
    """The task state it is performed in."""
    points: Array
    """The gesteme's reference, m, shape (K, 3), from any first point."""


def follow(
    reference: ArrayLike,
    operator: Operator,
    rng: np.random.Generator,
    segments: Sequence[int] | None = None,
) -> Trace:
    """Return the motion of a simulated hand along a reference trajectory (3.1.5).

    The reference is sampled points, m, shape (R, D), in two or three dimensions; `segments` tells
    which segment each of its points belongs to. The hand starts on its first point and in its
    direction. In each step it moves δ(1 + 2κΓ) along the mean of the direction to the target and
    its direction so far, plus κΓ for every element; Γ are independent standard normal deviates.
    A step may be negative: that is what the thesis says.
    Raises ValueError for a reference of fewer than two points or other dimensions, and
    OperatorStuckError when the hand does not come to the end of it.
    """
    points = np.asarray(reference, dtype=float)
    if points.ndim != 2 or len(points) < 2 or points.shape[1] not in (2, 3):
        raise ValueError(f"reference has shape {points.shape}, expected (R, 2) or (R, 3), R > 1")
    owner = np.zeros(len(points), dtype=np.intp) if segments is None else np.asarray(segments)
    last = len(points) - 1
    length_m = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    limit = int(operator.most_steps * (length_m / operator.step_m + 1))
    here, target, progress = points[0], 0, 0
    heading = _first_direction(points)
    positions, owners = [here], [owner[0]]
    while True:
        while target < last and _distance(points[target], here) <= operator.look_ahead_m:
            target += 1
        if target == last and (
            _distance(points[last], here) <= operator.stop_within_steps * operator.step_m
        ):
            return Trace(np.array(positions), np.array(owners, dtype=np.intp))
        if len(positions) > limit:
            raise OperatorStuckError(
                f"not at the end of the reference after {limit} steps with noise "
                f"{operator.noise:g}: take less noise, or a larger look_ahead_m"
            )
        towards = _unit(points[target] - here, heading)
        heading = 0.5 * (towards + heading)
        heading = heading + operator.noise * rng.standard_normal(points.shape[1])
        if operator.renormalize:
            heading = _unit(heading, towards)
        here = here + operator.step_m * (1 + 2 * operator.noise * rng.standard_normal()) * heading
        ahead = np.linalg.norm(points[progress : target + 1] - here, axis=1)
        progress += int(ahead.argmin())
        positions.append(here)
        owners.append(owner[progress])


def joined(paths: Sequence[ArrayLike], sample_m: float) -> tuple[Array, list[int]]:
    """Return one reference trajectory of several curves in turn, and the curve of each point.

    Each curve, shape (K, 3), is moved to where the one before it ended and sampled every
    `sample_m` or a little more densely.
    Raises ValueError when there is no curve, and as `Path` does.
    """
    if not paths:
        raise ValueError("no curves to join")
    pieces: list[Array] = []
    owners: list[int] = []
    here = np.zeros(3)
    for index, points in enumerate(paths):
        path = Path(np.asarray(points, dtype=float))
        count = max(2, int(np.ceil(path.length_m / sample_m)) + 1)
        sampled = path.at(np.linspace(0.0, path.length_m, count))
        sampled = here + sampled - sampled[0] if index else sampled
        here = sampled[-1]
        stop = None if index == len(paths) - 1 else -1
        pieces.append(sampled[:stop])
        owners += [index] * len(pieces[-1])
    return np.concatenate(pieces), owners


def perform(
    name: str,
    task: Sequence[TaskSegment],
    operator: Operator,
    rng: np.random.Generator,
    *,
    speed_m_s: float,
    rate_hz: float,
) -> Demonstration:
    """Return a simulated operator's performance of a task, as a labeled, timed demonstration.

    The segments are performed in turn, the first from its own first point; the hand's path is
    travelled at an even speed and sampled at an even rate, each sample labeled with its state.
    Raises ValueError for a speed or a rate that is not positive, and as `follow` and `joined` do.
    """
    if not (speed_m_s > 0 and rate_hz > 0):
        raise ValueError(f"speed {speed_m_s} m/s at {rate_hz} Hz, expected positive numbers")
    reference, owners = joined([segment.points for segment in task], operator.step_m / 2)
    trace = follow(reference, operator, rng, owners)
    path = Path(trace.positions)
    count = max(2, int(path.length_m / speed_m_s * rate_hz) + 1)
    time_s = np.arange(count) / rate_hz
    travelled_m = np.minimum(time_s * speed_m_s, path.length_m)
    behind = np.searchsorted(path.arc_length, travelled_m, side="right") - 1
    states = tuple(task[trace.segments[index]].state for index in behind)
    return Demonstration(name, time_s, path.at(travelled_m), states)


def _first_direction(points: Array) -> Array:
    away = points - points[0]
    moved = np.flatnonzero(np.linalg.norm(away, axis=1) > 0)
    if not len(moved):
        raise ValueError("all points of the reference are the same")
    return _unit(away[moved[0]], away[moved[0]])


def _unit(vector: Array, otherwise: Array) -> Array:
    length = np.linalg.norm(vector)
    return np.asarray(vector / length) if length > 0 else otherwise


def _distance(a: Array, b: Array) -> float:
    return float(np.linalg.norm(a - b))
