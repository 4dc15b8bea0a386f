"""Motion that is no part of a task: other shapes, smooth random motion, and reaches at random."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.lasa import drawings, shapes
from hmcs.motion.steps import Step

_SEVERAL = "Multi_Models"


class Smooth(NamedTuple):
    """Motion whose curvature is an Ornstein-Uhlenbeck process; as large as drawings on a tablet."""

    curvature_per_m: float = 28.0
    """Its standard deviation, 1/m: bends of some 36 mm."""
    correlation_m: float = 0.042
    """Length of path over which it falls to 1/e."""
    sample_m: float = 0.0005


class Reaches(NamedTuple):
    """Point-to-point motion of minimum jerk (Flash and Hogan 1985), slightly bent, with tremor."""

    length_m: tuple[float, float] = (0.014, 0.07)
    """Of a reach, from and to; any direction is as probable as any other."""
    bend: float = 0.12
    """Standard deviation of its sagitta, as a share of its length."""
    tremor_m: float = 0.0002
    """Standard deviation of a sample along each axis."""
    samples: int = 100
    """Of a reach, at equal times."""


def smooth_motion(smooth: Smooth, length_m: float, rng: np.random.Generator) -> Array:
    """Return smooth random motion of that length in the plane z = 0, m, shape (K, 3)."""
    count = int(np.ceil(length_m / smooth.sample_m))
    kept = np.exp(-smooth.sample_m / smooth.correlation_m)
    curvature = np.empty(count)
    here = smooth.curvature_per_m * rng.standard_normal()
    shocks = smooth.curvature_per_m * np.sqrt(1.0 - kept**2) * rng.standard_normal(count)
    for k, shock in enumerate(shocks):
        here = curvature[k] = kept * here + shock
    heading = rng.uniform(0.0, 2.0 * np.pi) + smooth.sample_m * np.cumsum(curvature)
    positions = np.zeros((count + 1, 3))
    moves = smooth.sample_m * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    positions[1:, :2] = np.cumsum(moves, axis=0)
    return positions


def random_reaches(reaches: Reaches, length_m: float, rng: np.random.Generator) -> Array:
    """Return reaches in the plane z = 0, together at least that long, m, shape (K, 3)."""
    time = np.linspace(0.0, 1.0, reaches.samples)
    along = 10.0 * time**3 - 15.0 * time**4 + 6.0 * time**5
    here, done_m, paths = np.zeros(2), 0.0, []
    while done_m < length_m:
        reach_m, angle_rad = rng.uniform(*reaches.length_m), rng.uniform(0.0, 2.0 * np.pi)
        move = reach_m * np.array([np.cos(angle_rad), np.sin(angle_rad)])
        aside = reaches.bend * rng.standard_normal() * np.sin(np.pi * along)
        paths.append(here + np.outer(along, move) + np.outer(aside, [-move[1], move[0]]))
        here, done_m = here + move, done_m + reach_m
    flat = np.concatenate(paths)
    positions = np.zeros((len(flat), 3))
    positions[:, :2] = flat + reaches.tremor_m * rng.standard_normal(flat.shape)
    return positions


def other_drawings(known: Sequence[str], count: int, rng: np.random.Generator) -> Array:
    """Return drawings of so many shapes that are not `known`, one after another, m, shape (K, 3).

    Shapes and drawings are drawn by lot. Those that are drawn in several ways, which other shapes
    are among, are left out. Raises ValueError where there are not so many.
    """
    others = [name for name in shapes() if name not in known and not name.startswith(_SEVERAL)]
    if not 1 <= count <= len(others):
        raise ValueError(f"{count} other shapes: expected 1 to {len(others)}")
    here, paths = np.zeros(2), []
    for name in rng.choice(others, size=count, replace=False):
        choices = drawings(str(name))
        drawn_m = choices[int(rng.integers(len(choices)))].positions
        paths.append(here + drawn_m - drawn_m[0])
        here = paths[-1][-1]
    flat = np.concatenate(paths)
    return np.column_stack([flat, np.zeros(len(flat))])


def after(steps: Sequence[Step], following: Sequence[Step]) -> tuple[Step, ...]:
    """Return other steps as if they had been made after `steps`, where these ended."""
    shift = steps[-1].position + steps[-1].displacement - following[0].position
    return tuple(
        step._replace(index=steps[-1].index + k, position=step.position + shift)
        for k, step in enumerate(following, start=1)
    )
