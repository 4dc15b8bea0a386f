"""What operators are assisted in: the path they were taught, the one they mean, what is in the way.

Each scenario is made from the same random numbers for every law, so that laws differ in nothing
else.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.demonstrations import read_csv
from hmcs.motion.lasa import drawings, read_drawing
from hmcs.motion.operators import joined
from hmcs.motion.paths import Path, resample
from hmcs.task import Obstacle, Task, Workspace, find_task, load_task
from hmcs_laboratory.assistance.detours import Detour, around

_SAMPLE_M = 0.002
LENGTHS = (0.7, 1.3)
"""In a changed workspace every line is so many times as long as it was taught, drawn by lot."""
WRONG_BY_M = 0.02
"""So far beside the taught curves is what an operator means whose model is wrong."""
WALL_CHANGES_M = (0.03, 0.06)
"""So much higher or lower is the wall of experiment 2."""
OBSTACLE_M = 0.02
"""Radius of the unexpected obstacle."""
CLEARANCE_M = 0.015
"""That operators mean to keep from it."""
RUN_UP_M = 0.03
"""So long before it they begin to leave the path."""
_DRAWING_POINTS = 200


class Taught(NamedTuple):
    """A task, and the path along which it is demonstrated."""

    task: Task
    path: Path
    """In the workspace, m."""
    states: tuple[str, ...]
    """Of its segments, in their order."""
    ends_m: Array
    """Arc length at which each segment ends, m, shape (S,)."""

    @property
    def lengths_m(self) -> Array:
        """Of the segments, m, shape (S,)."""
        return np.diff(np.concatenate([[0.0], self.ends_m]))

    def state_at(self, progress_m: float) -> str:
        """Return the state that the path is in so far along it."""
        return state_at(self.states, self.ends_m, progress_m)


def state_at(states: Sequence[str], ends_m: Array, progress_m: float) -> str:
    """Return the state whose segment, ending at `ends_m`, has the place `progress_m` in it."""
    index = int(np.searchsorted(ends_m, progress_m, side="right"))
    return states[min(index, len(states) - 1)]


class Sphere(NamedTuple):
    """Something in the way."""

    center: Array
    """m, shape (3,)."""
    radius_m: float


class Scenario(NamedTuple):
    """What an operator means to do."""

    meant: Path
    """m, workspace."""
    obstacle: Sphere | None = None
    detour: Detour | None = None
    """How the operator goes around it."""
    usual: Path | None = None
    """The path without the detour."""
    workspace: Workspace | None = None
    """Where it is performed; the task's own where None."""
    states: tuple[str, ...] = ()
    """What is meant by each segment, where it is not what was taught in that place."""
    ends_m: Array | None = None
    """Arc length at which each of them ends, m."""


Family = Callable[[np.random.Generator, float], Taught]
"""Makes what is taught in a trial; with the dead zone δ, m."""
Meaning = Callable[[Taught, np.random.Generator], Scenario]
"""Makes what the operator means to do then."""


def taught_lines(rng: np.random.Generator, dead_zone_m: float) -> Taught:
    """Return the four lines of experiment 1 (fig. 3.8)."""
    del rng
    task = load_task("lines-through-obstacles").model_copy(update={"dead_zone_m": dead_zone_m})
    corners = read_csv(find_task("lines-through-obstacles").with_suffix(".csv")).positions
    return _taught(task, list(pairwise(corners)))


def taught_curves(rng: np.random.Generator, dead_zone_m: float) -> Taught:
    """Return the five human-drawn curves of the shipped chain, of each one drawing by lot."""
    task = load_task("human-shapes").model_copy(update={"dead_zone_m": dead_zone_m})
    curves = []
    for state in task.states:
        shape = state.gestemes[0]
        number = int(rng.integers(1, len(drawings(shape)) + 1))
        curves.append(resample(read_drawing(shape, number, task).positions, _DRAWING_POINTS))
    return _taught(task, curves)


def taught_on_surface(rng: np.random.Generator, dead_zone_m: float) -> Taught:
    """Return the six strokes on a plane surface (section 4.3, fig. 4.15 left)."""
    del rng
    return _taught_along_file("surface-2d", dead_zone_m)


def taught_around_object(rng: np.random.Generator, dead_zone_m: float) -> Taught:
    """Return the way around an object that is not to be touched (section 4.3, fig. 4.15 right)."""
    del rng
    return _taught_along_file("object-3d", dead_zone_m)


def as_taught(taught: Taught, rng: np.random.Generator) -> Scenario:
    """Return the path as it was taught."""
    del rng
    return Scenario(taught.path)


def unseen_order(taught: Taught, rng: np.random.Generator) -> Scenario:
    """Return what is taught on the surface in the order of fig. 4.17, which nobody taught."""
    del rng
    order = [0, 1, 2, 0, 4, 3]
    curves = _segments(taught)
    meant, _ = joined([curves[k] for k in order], _SAMPLE_M)
    path = Path(meant + taught.path.points[0] - meant[0])
    return Scenario(
        path,
        states=tuple(taught.states[k] for k in order),
        ends_m=np.cumsum(taught.lengths_m[order]),
    )


def changed_lengths(taught: Taught, rng: np.random.Generator) -> Scenario:
    """Return the path with every segment longer or shorter than taught (experiment 2)."""
    return Scenario(_stretched(taught, rng.uniform(*LENGTHS, size=len(taught.states))))


def changed_obstacle(taught: Taught, rng: np.random.Generator) -> Scenario:
    """Return the path over a wall that is higher or lower than taught (experiment 2, fig. 3.9 c).

    What leads up to it and down from it is as much longer or shorter.
    """
    change_m = float(rng.uniform(*WALL_CHANGES_M) * rng.choice([-1.0, 1.0]))
    factors = 1.0 + np.array([change_m, 0.0, 0.0, change_m]) / taught.lengths_m
    space = taught.task.workspace
    obstacles = tuple(
        _higher(obstacle, change_m) if obstacle.name == "wall" else obstacle
        for obstacle in space.obstacles
    )
    workspace = space.model_copy(update={"obstacles": obstacles})
    return Scenario(_stretched(taught, factors), workspace=workspace)


def unexpected_obstacle(taught: Taught, rng: np.random.Generator) -> Scenario:
    """Return the path around a sphere that nobody taught (experiment 3)."""
    lengths = taught.lengths_m
    needed_m = 2.0 * (OBSTACLE_M + CLEARANCE_M + RUN_UP_M)
    segment = int(rng.choice(np.flatnonzero(lengths > needed_m)))
    spare_m = lengths[segment] - needed_m
    at_m = taught.ends_m[segment] - 0.5 * lengths[segment] + spare_m * rng.uniform(-0.4, 0.4)
    aside = rng.normal(size=3)
    aside *= 0.25 * OBSTACLE_M / np.linalg.norm(aside)
    obstacle = Sphere(taught.path.at(at_m) + aside, OBSTACLE_M)
    detour = around(
        taught.path,
        obstacle.center,
        obstacle.radius_m,
        clearance_m=CLEARANCE_M,
        run_up_m=RUN_UP_M,
    )
    return Scenario(detour.path, obstacle, detour, taught.path)


def beside_the_model(taught: Taught, rng: np.random.Generator) -> Scenario:
    """Return each curve bent to one side: between its ends it lies beside what was taught."""
    curves = []
    for points in _segments(taught):
        share = np.linspace(0.0, 1.0, len(points))
        rise = np.clip(np.minimum(share, 1.0 - share) / 0.2, 0.0, 1.0)
        aside = 0.5 * (1.0 - np.cos(np.pi * rise))
        tangents = np.gradient(points, axis=0)
        tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-12)
        across = np.cross(tangents, _normal(points)) * rng.choice([-1.0, 1.0])
        curves.append(points + WRONG_BY_M * aside[:, None] * across)
    meant, _ = joined(curves, _SAMPLE_M)
    return Scenario(Path(meant))


class AssistedTask(NamedTuple):
    """A task of the study."""

    family: str
    meaning: Meaning


FAMILIES: Mapping[str, Family] = {
    "lines": taught_lines,
    "curves": taught_curves,
    "surface": taught_on_surface,
    "object": taught_around_object,
}
TASKS: Mapping[str, AssistedTask] = {
    "lines": AssistedTask("lines", as_taught),
    "changed-workspace": AssistedTask("lines", changed_lengths),
    "unexpected-obstacle": AssistedTask("lines", unexpected_obstacle),
    "human-curves": AssistedTask("curves", as_taught),
    "wrong-model": AssistedTask("curves", beside_the_model),
}
"""Tasks by name; those of a family are taught alike."""


def _taught_along_file(name: str, dead_zone_m: float) -> Taught:
    task = load_task(name).model_copy(update={"dead_zone_m": dead_zone_m})
    meant = read_csv(find_task(name).with_suffix(".csv"))
    return _taught(task, [meant.positions[samples] for _, samples in meant.stretches])


def _taught(task: Task, curves: Sequence[Sequence[Array] | Array]) -> Taught:
    whole, owners = joined([np.asarray(curve) for curve in curves], _SAMPLE_M)
    path = Path(whole + np.asarray(task.robot.tool_start_m) - whole[0])
    last = np.searchsorted(owners, np.arange(len(curves)), side="right")
    ends_m = path.arc_length[np.minimum(last, len(whole) - 1)]
    return Taught(task, path, tuple(state.name for state in task.states), ends_m)


def _stretched(taught: Taught, factors: Array) -> Path:
    """The taught path with each segment so many times as long."""
    curves = [
        factor * (points - points[0])
        for factor, points in zip(factors, _segments(taught), strict=True)
    ]
    meant, _ = joined(curves, _SAMPLE_M)
    return Path(meant + taught.path.points[0])


def _higher(obstacle: Obstacle, by_m: float) -> Obstacle:
    """A box that stands where it stood and is so much higher."""
    assert obstacle.size_m is not None
    (x, y, z), (width, depth, height) = obstacle.position_m, obstacle.size_m
    return obstacle.model_copy(
        update={"position_m": (x, y, z + by_m / 2), "size_m": (width, depth, height + by_m)}
    )


def _segments(taught: Taught) -> list[Array]:
    begins_m = np.concatenate([[0.0], taught.ends_m[:-1]])
    return [
        taught.path.at(np.linspace(begin, end, max(2, int((end - begin) / _SAMPLE_M) + 1)))
        for begin, end in zip(begins_m, taught.ends_m, strict=True)
    ]


def _normal(points: Array) -> Array:
    """Unit normal of the plane a curve lies in, or of one it lies in if it is a line."""
    normal = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][-1]
    return np.asarray(normal)
