"""The tasks of chapters 3 and 4, performed by a simulated hand."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.operators import joined
from hmcs.motion.references import References, random_gesteme, random_gestemes, turn_rad
from hmcs.recognition.segments import LearningError, segments_of
from hmcs_laboratory.data.hands import Count, CurveSettings, NotNegative, Positive, moved
from hmcs_laboratory.data.tasks import TaskSet, as_performance, sequential_task

FIVE_STATES = ("l1", "c1", "l2", "c1", "l3")
"""Gestemes of the states of fig. 4.11: one arc serves two of them."""
TRAINED_ORDER = ("l1", "l2", "c1", "l2", "c1", "l1")
"""Fig. 4.16."""
UNSEEN_ORDER = ("l1", "l2", "c1", "l1", "c1", "l2")
"""Fig. 4.17."""

_DRAWS = 10
"""An arc that almost closes is cut short by some hands, which then show nothing to learn: other
curves are drawn, so often at most."""


class TaskSettings(CurveSettings):
    """How tasks are demonstrated and performed; a gesteme's kind is the task's choice."""

    demonstrations: Count = 5
    performances: Count = 5
    """To recognize, in each trial."""
    dead_zone_m: Positive = 0.01
    """Of the recognizer. Far below `step_m` every sample of the hand is a step, but for those
    that err to almost nothing; the thesis leaves open which it took."""
    alike_deg: NotNegative | None = None
    """Of the five-state task: l3 goes so little off l1 that they are confused; by lot if None."""
    samples_per_step: Count = 1
    """Above 1 the hand's path is interpolated so finely, and the dead zone makes the steps."""


def five_states(settings: TaskSettings, noise: float, rng: np.random.Generator) -> TaskSet:
    """Return the task of fig. 4.11: three lines and an arc that stands between them twice."""
    return _performed_task("five-states", settings, [FIVE_STATES], noise, rng)


def six_segments(
    settings: TaskSettings, noise: float, rng: np.random.Generator
) -> tuple[TaskSet, TaskSet]:
    """Return the task of figs 4.16 and 4.17, performed in its trained and in an unseen order.

    Both have the same demonstrations, all of the trained order. A step of the unseen order is
    labeled with the first state of its gesteme: only the gesteme is true of it.
    """
    trained = _performed_task("six-segments", settings, [TRAINED_ORDER, UNSEEN_ORDER], noise, rng)
    first = {gesteme: f"S{TRAINED_ORDER.index(gesteme) + 1}" for gesteme in UNSEEN_ORDER}
    unseen = [
        _demonstrated(
            f"unseen-{k}",
            [first[g] for g in UNSEEN_ORDER],
            trained.references,
            UNSEEN_ORDER,
            settings,
            noise,
            rng,
        )
        for k in range(settings.performances)
    ]
    return trained, trained._replace(
        performances=tuple(as_performance(each, trained.task) for each in unseen)
    )


def of_other_sizes(
    data: TaskSet,
    settings: TaskSettings,
    noise: float,
    size: float,
    turn_rad: float,
    rng: np.random.Generator,
) -> TaskSet:
    """Return a sequential task performed in other sizes and turns than it was learned in.

    Each segment is scaled by a factor of its own in 1 ± size and turned about its beginning by an
    angle of its own in ± turn, in space about a random axis. The demonstrations are those of
    `data`.
    """
    states = [state.name for state in data.task.states]
    performances = []
    for k in range(settings.performances):
        curves = {
            state.name: _similar(
                data.references[state.gestemes[0]], settings.dimensions, size, turn_rad, rng
            )
            for state in data.task.states
        }
        made = _demonstrated(f"other-{k}", states, curves, states, settings, noise, rng)
        performances.append(as_performance(made, data.task))
    return data._replace(performances=tuple(performances))


def line_task(
    settings: TaskSettings, lines: int, noise: float, rng: np.random.Generator
) -> TaskSet:
    """Return a task of chapter 3: a state for each of several random lines (3.1.5)."""
    references = settings.model_copy(update={"kind": "line"}).references
    drawn = random_gestemes(references, lines, rng)
    curves = {f"l{k}": points for k, points in enumerate(drawn, start=1)}
    return _performances("lines", settings, tuple(curves), curves, noise, rng)


def random_curves(
    kinds: Mapping[str, References], orders: Sequence[Sequence[str]], rng: np.random.Generator
) -> dict[str, Array]:
    """Return a random curve for each gesteme, m, shape (K, 3).

    In all of the orders gestemes follow one another with a turn of at least θ_min.
    """
    pairs = sorted({pair for order in orders for pair in pairwise(order)})
    while True:
        curves = {name: random_gesteme(kind, rng) for name, kind in kinds.items()}
        if all(turn_rad(curves[a], curves[b]) >= kinds[b].least_turn_rad for a, b in pairs):
            return curves


def _with_alike(
    curves: dict[str, Array],
    kinds: Mapping[str, References],
    orders: Sequence[Sequence[str]],
    alike_rad: float,
    rng: np.random.Generator,
) -> dict[str, Array]:
    """Draw curves until l3, turned off l1 by `alike_rad`, still turns away from what it follows."""
    while True:
        longer = float(np.linalg.norm(curves["l3"][-1]) / np.linalg.norm(curves["l1"][-1]))
        axis = _normal_of(curves["l1"], kinds["l1"].dimensions, rng)
        turned = curves | {"l3": longer * _turned(curves["l1"], alike_rad, axis)}
        if all(
            turn_rad(turned[a], turned[b]) >= kinds[b].least_turn_rad
            for order in orders
            for a, b in pairwise(order)
        ):
            return turned
        curves = random_curves(kinds, orders, rng)


def _normal_of(line: Array, dimensions: int, rng: np.random.Generator) -> Array:
    """A unit vector across a line: out of the plane or, in space, drawn by lot."""
    if dimensions == 2:
        return np.array([0.0, 0.0, 1.0])
    axis = np.cross(line[-1], rng.normal(size=3))
    return np.asarray(axis / np.linalg.norm(axis))


def _similar(
    points: Array, dimensions: int, size: float, turn_rad: float, rng: np.random.Generator
) -> Array:
    factor, angle = rng.uniform(1.0 - size, 1.0 + size), rng.uniform(-turn_rad, turn_rad)
    axis = np.array([0.0, 0.0, 1.0])
    if dimensions == 3:
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
    return factor * _turned(points, angle, axis)


def _turned(points: Array, angle: float, axis: Array) -> Array:
    """Points turned about a unit vector, by Rodrigues' formula."""
    across = np.cross(axis, points)
    turned = points + np.sin(angle) * across + (1.0 - np.cos(angle)) * np.cross(axis, across)
    return np.asarray(turned)


def _performed_task(
    name: str,
    settings: TaskSettings,
    orders: Sequence[Sequence[str]],
    noise: float,
    rng: np.random.Generator,
) -> TaskSet:
    kinds = {
        gesteme: settings.model_copy(
            update={"kind": "line" if gesteme.startswith("l") else "circle"}
        ).references
        for gesteme in orders[0]
    }
    for _ in range(_DRAWS):
        curves = random_curves(kinds, orders, rng)
        if settings.alike_deg is not None:
            curves = _with_alike(curves, kinds, orders, math.radians(settings.alike_deg), rng)
        made = _performances(name, settings, orders[0], curves, noise, rng)
        try:
            segments_of(made.task, made.demonstrations)
        except LearningError as error:
            cut_short = error
        else:
            return made
    raise cut_short


def _performances(
    name: str,
    settings: TaskSettings,
    order: Sequence[str],
    curves: Mapping[str, Array],
    noise: float,
    rng: np.random.Generator,
) -> TaskSet:
    task = sequential_task(
        name, order, dead_zone_m=settings.dead_zone_m, dimensions=settings.dimensions
    )
    states = [state.name for state in task.states]
    made = [
        _demonstrated(f"{name}-{k}", states, curves, order, settings, noise, rng)
        for k in range(settings.demonstrations + settings.performances)
    ]
    return TaskSet(
        task,
        tuple(made[: settings.demonstrations]),
        tuple(as_performance(each, task) for each in made[settings.demonstrations :]),
        curves,
    )


def _demonstrated(
    name: str,
    states: Sequence[str],
    curves: Mapping[str, Array],
    order: Sequence[str],
    settings: TaskSettings,
    noise: float,
    rng: np.random.Generator,
) -> Demonstration:
    """Return a labeled motion along the curves in that order; a sample of the hand a second."""
    reference, owners = joined([curves[gesteme] for gesteme in order], settings.step_m / 2)
    trace = moved(reference[:, : settings.dimensions], settings.operator(noise), rng, owners)
    last = len(trace.positions) - 1
    time_s = np.linspace(0.0, last, last * settings.samples_per_step + 1)
    positions = np.zeros((len(time_s), 3))
    for axis, column in enumerate(trace.positions.T):
        positions[:, axis] = np.interp(time_s, np.arange(last + 1), column)
    behind = np.arange(len(time_s)) // settings.samples_per_step
    labels = tuple(states[segment] for segment in trace.segments[behind])
    return Demonstration(name, time_s, positions, labels)
