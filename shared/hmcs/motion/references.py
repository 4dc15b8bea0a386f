"""Random gestemes and tasks: the lines and arcs of the synthetic study (thesis, 3.1.5 and 4.2)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.operators import TaskSegment
from hmcs.task import Task


@dataclass(frozen=True)
class References:
    """Which gestemes a random study is made of; the defaults are those of the project's re-runs.

    Raises ValueError where a range is empty or not positive, or the dimensions are not 2 or 3.
    """

    kind: Literal["line", "circle", "mixed"] = "mixed"
    """Lines only, arcs of circles only, or each with probability one half."""
    dimensions: int = 2
    """2: in the plane z = 0; 3: any direction in space."""
    length_m: tuple[float, float] = (0.5, 1.5)
    """Of a line: between ℓ_min and ℓ_max, m."""
    radius_m: tuple[float, float] = (0.15, 0.5)
    """Of an arc, m."""
    angle_rad: tuple[float, float] = (math.pi / 2, 2 * math.pi)
    """Of an arc."""
    least_turn_rad: float = math.pi / 6
    """θ_min: the least angle between the end of one gesteme and the start of the next."""
    sample_m: float = 0.025
    """Distance between sampled points, m."""

    def __post_init__(self) -> None:
        if self.dimensions not in (2, 3):
            raise ValueError(f"dimensions is {self.dimensions}, expected 2 or 3")
        for name in ("length_m", "radius_m", "angle_rad"):
            lower, upper = getattr(self, name)
            if not 0 < lower <= upper:
                raise ValueError(f"{name} is {(lower, upper)}, expected 0 < lower <= upper")
        if not 0 <= self.least_turn_rad < math.pi:
            raise ValueError(f"least_turn_rad is {self.least_turn_rad}, expected 0 <= θ < π")
        if not self.sample_m > 0:
            raise ValueError(f"sample_m is {self.sample_m}, expected more than 0")

    def scaled(self, factor: float) -> References:
        """Return the same study with every length so many times as large."""
        return References(
            self.kind,
            self.dimensions,
            (self.length_m[0] * factor, self.length_m[1] * factor),
            (self.radius_m[0] * factor, self.radius_m[1] * factor),
            self.angle_rad,
            self.least_turn_rad,
            self.sample_m * factor,
        )


def random_gesteme(references: References, rng: np.random.Generator) -> Array:
    """Return the points of a random line or arc, m, shape (K, 3), beginning at 0."""
    forward, sideways = _random_frame(references.dimensions, rng)
    lines = references.kind == "line" or (references.kind == "mixed" and rng.random() < 0.5)
    if lines:
        length_m = rng.uniform(*references.length_m)
        s = _samples(length_m, references.sample_m)
        return s[:, None] * forward
    radius_m = rng.uniform(*references.radius_m)
    s = _samples(radius_m * rng.uniform(*references.angle_rad), references.sample_m) / radius_m
    return radius_m * (np.sin(s)[:, None] * forward + (1 - np.cos(s))[:, None] * sideways)


def random_gestemes(references: References, count: int, rng: np.random.Generator) -> list[Array]:
    """Return random gestemes that follow one another with a turn of θ_min at least."""
    gestemes: list[Array] = []
    while len(gestemes) < count:
        points = random_gesteme(references, rng)
        if not gestemes or turn_rad(gestemes[-1], points) >= references.least_turn_rad:
            gestemes.append(points)
    return gestemes


def random_performance(
    task: Task, gestemes: Mapping[str, Array], rng: np.random.Generator, most_segments: int
) -> list[TaskSegment]:
    """Return the segments of a random run through a task's states.

    Starts and successors are drawn with the task's probabilities, and one of a state's gestemes
    with equal ones; it ends where the task does, or after `most_segments`.
    """
    segments: list[TaskSegment] = []
    follow: Mapping[str, float] = task.start
    while follow and len(segments) < most_segments:
        state = task.state(rng.choice(list(follow), p=_shares(follow)))
        gesteme = state.gestemes[int(rng.integers(len(state.gestemes)))]
        segments.append(TaskSegment(state.name, gestemes[gesteme]))
        follow = state.next
    return segments


def turn_rad(before: Array, after: Array) -> float:
    """Return the angle between the end of one gesteme and the start of the next."""
    end, start = before[-1] - before[-2], after[1] - after[0]
    cosine = end @ start / (np.linalg.norm(end) * np.linalg.norm(start))
    return math.acos(min(max(cosine, -1.0), 1.0))


def _samples(length_m: float, sample_m: float) -> Array:
    return np.linspace(0.0, length_m, max(2, math.ceil(length_m / sample_m) + 1))


def _random_frame(dimensions: int, rng: np.random.Generator) -> tuple[Array, Array]:
    vectors = np.zeros((2, 3))
    vectors[:, :dimensions] = rng.standard_normal((2, dimensions))
    forward = vectors[0] / np.linalg.norm(vectors[0])
    sideways = vectors[1] - vectors[1] @ forward * forward
    return forward, sideways / np.linalg.norm(sideways)


def _shares(follow: Mapping[str, float]) -> Array:
    shares = np.fromiter(follow.values(), dtype=float)
    return np.asarray(shares / shares.sum())
