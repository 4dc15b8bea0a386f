"""A study of chapter 3: how many directions a task of lines has, and which one is followed."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field
from sklearn.cluster import KMeans
from sklearn.metrics import silhouette_score

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import Step
from hmcs.recognition.learning import learn
from hmcs.recognition.model import axes_of
from hmcs.recognition.registry import recognizer_of
from hmcs.recognition.scoring import pooled, score
from hmcs.task import Task
from hmcs_baselines.direction_states import (
    DirectionFilter,
    DirectionStateSettings,
    learn_directions,
    thesis_settings,
    unit_rows,
)
from hmcs_baselines.directions import (
    DirectionSettings,
    FoundDirections,
    distinct_directions,
    elbow_directions,
    find_directions,
)
from hmcs_laboratory.data.hands import Count, NotNegative, Share
from hmcs_laboratory.data.synthetic_tasks import TaskSettings, line_task
from hmcs_laboratory.data.tasks import Performance, TaskSet, as_performance, path_of, plain_task
from hmcs_laboratory.study import Measured, Study, seed_from, stream_of

Integers = NDArray[np.int64]

What = Literal["number", "following"]
Counting = Literal["chords", "kmeans-cusum", "silhouette"]
Following = Literal["chapter-3", "directions", "hmcs-segment-filter"]
Name = Literal[Counting, Following]

Follower = Callable[[Performance], Array]
"""Returns P(direction | steps so far) after each step, shape (T, K)."""

MOST_DIRECTIONS = 15
"""That clustering looks for."""


def _rising(counts: tuple[int, int]) -> tuple[int, int]:
    if counts[0] > counts[1]:
        raise ValueError("expected the lower one first")
    return counts


LineCounts = Annotated[tuple[Count, Count], AfterValidator(_rising)]


class DirectionsSettings(TaskSettings):
    """Of the study `directions`; every gesteme is a line."""

    dimensions: Annotated[int, Field(ge=2, le=3)] = 3
    demonstrations: Count = 6
    what: Annotated[tuple[What, ...], Field(min_length=1)] = ("number", "following")
    """How many directions are found, or how soon a change of direction is noticed."""
    noise: tuple[NotNegative, ...] = (0.15, 0.3)
    """κ of (3.3)."""
    tasks: Count = 10
    """In each trial, at each noise."""
    lines: LineCounts = (4, 6)
    """Of a task whose directions are counted, from and to."""
    followed_lines: Annotated[int, Field(ge=2)] = 4
    """Of a task that is followed."""
    sure: Share = 0.95
    """A change is reported when the direction after it is more probable than this."""
    methods: tuple[Name, ...] = ()
    """All where none is named."""


def directions_trial(settings: DirectionsSettings, rng: np.random.Generator) -> list[Measured]:
    """Count directions, and follow them, at every noise."""
    rows: list[Measured] = []
    for noise, stream in zip(settings.noise, rng.spawn(len(settings.noise)), strict=True):
        to_count, to_follow = stream.spawn(2)
        if "number" in settings.what:
            rows += _numbers(settings, noise, to_count)
        if "following" in settings.what:
            rows += _delays(settings, noise, to_follow)
    return rows


def _numbers(
    settings: DirectionsSettings, noise: float, rng: np.random.Generator
) -> Iterator[Measured]:
    fewest, most = settings.lines
    data = [
        line_task(settings, int(rng.integers(fewest, most + 1)), noise, rng)
        for _ in range(settings.tasks)
    ]
    positions = [_paths(each) for each in data]
    angle_rad = DirectionSettings().merge_angle_rad
    true = np.array([len(distinct_directions(_lines_of(each), angle_rad)) for each in data])
    seed = seed_from(rng)
    for name, find in _COUNTING.items():
        if settings.methods and name not in settings.methods:
            continue
        method_rng = stream_of(name, seed)
        began_s = time.thread_time()
        found = np.array([find(own, method_rng) for own in positions])
        spent_s = time.thread_time() - began_s
        samples = sum(len(one) for own in positions for one in own)
        yield Measured(
            name,
            {"what": "number", "noise": noise},
            {
                "exact": float((found == true).mean()),
                "found": float(found.mean()),
                "true": float(true.mean()),
                "fit_s": spent_s / len(data),
                "us_per_sample": 1e6 * spent_s / samples,
            },
        )


def _delays(
    settings: DirectionsSettings, noise: float, rng: np.random.Generator
) -> Iterator[Measured]:
    data = [line_task(settings, settings.followed_lines, noise, rng) for _ in range(settings.tasks)]
    seed = seed_from(rng)
    for name, learned in _FOLLOWING.items():
        if settings.methods and name not in settings.methods:
            continue
        method_rng = stream_of(name, seed)
        delays: list[int] = []
        scores = []
        fit_s = spent_s = 0.0
        for each in data:
            began_s = time.thread_time()
            directions, follow = learned(each, method_rng)
            fit_s += time.thread_time() - began_s
            nearest = (_lines_of(each) @ directions.T).argmax(axis=1)
            for performance in each.performances:
                began_s = time.thread_time()
                believed = follow(performance)
                spent_s += time.thread_time() - began_s
                delays += _sure_delays(performance.states, believed, nearest, settings.sure)
                scores.append(score(nearest[performance.states], believed.argmax(axis=1)))
        every = pooled(scores)
        yield Measured(
            name,
            {"what": "following", "noise": noise},
            {
                "direction_accuracy": every.accuracy,
                "delay_median_steps": float(np.median(delays)),
                "delay_p95_steps": float(np.percentile(delays, 95)),
                "false_switches_per_1000": every.false_switches_per_1000_steps,
                "fit_s": fit_s / len(data),
                "us_per_sample": 1e6 * spent_s / every.steps,
            },
        )


def _sure_delays(lines: Integers, believed: Array, nearest: Integers, sure: float) -> list[int]:
    """Steps from every change of line to P(its direction) > `sure`; never counts as all its steps.

    `nearest` is the direction of each line. A line whose direction is that of the line before is
    never announced.
    """
    edges = [0, *(np.flatnonzero(np.diff(lines)) + 1).tolist(), len(lines)]
    delays = []
    for begin, end in pairwise(edges):
        own = nearest[lines[begin]]
        sure_at = np.flatnonzero(believed[begin:end, own] > sure)
        hidden = begin > 0 and nearest[lines[begin - 1]] == own
        delays.append(end - begin if hidden or not len(sure_at) else int(sure_at[0]))
    return delays


def _silhouette(positions: Sequence[Array], rng: np.random.Generator) -> int:
    """The number of clusters of the directions of all steps with the best mean silhouette."""
    units = unit_rows(np.concatenate([np.diff(own, axis=0) for own in positions]))
    scores = {}
    for count in range(2, MOST_DIRECTIONS + 1):
        means = KMeans(count, n_init=10, random_state=int(rng.integers(2**31)))
        scores[count] = silhouette_score(units, means.fit_predict(units))
    return max(scores, key=scores.__getitem__)


def _by_directions(
    chosen: DirectionStateSettings, data: TaskSet, rng: np.random.Generator
) -> tuple[Array, Follower]:
    moves = [np.diff(own, axis=0) for own in _paths(data)]
    known = learn_directions(moves, chosen, rng)
    axes = list(axes_of(data.task))

    def follow(performance: Performance) -> Array:
        follower = DirectionFilter(known)
        return np.array([follower.step(step.displacement[axes]) for step in performance.steps])

    return known.directions, follow


def _segment_filter(data: TaskSet, rng: np.random.Generator) -> tuple[Array, Follower]:
    """The segment filter, taught by the segments that chords cut the demonstrations into."""
    found = find_directions(_paths(data))
    names = [f"direction-{k}" for k in range(len(found.directions))]
    task = _task_of(found, names, data)
    demonstrations = [
        Demonstration(
            str(k),
            np.arange(len(labels) + 1, dtype=np.float64),
            path_of(steps),
            tuple(names[label] for label in [*labels, labels[-1]]),
        )
        for k, (steps, labels) in enumerate(zip(_taught(data), found.labels, strict=True))
    ]
    model = learn(task, demonstrations, rng=rng)

    def follow(performance: Performance) -> Array:
        recognizer = recognizer_of(model)
        steps = performance.unmarked().steps
        return np.array([recognizer.step(step).belief.states for step in steps])

    return found.directions, follow


def _task_of(found: FoundDirections, names: Sequence[str], data: TaskSet) -> Task:
    """A state for each direction, followed by the others as often as in the demonstrations."""
    counts = np.zeros((len(names), len(names)))
    for labels in found.labels:
        changed = labels[1:] != labels[:-1]
        np.add.at(counts, (labels[:-1][changed], labels[1:][changed]), 1.0)
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    return plain_task(
        "directions",
        {
            name: (name, {other: float(p) for other, p in zip(names, row, strict=True) if p > 0})
            for name, row in zip(names, shares, strict=True)
        },
        list(dict.fromkeys(names[labels[0]] for labels in found.labels)),
        # The steps found in the demonstrations stay steps.
        dead_zone_m=data.task.dead_zone_m / 2,
        dimensions=found.directions.shape[1],
    )


def _paths(data: TaskSet) -> list[Array]:
    """The demonstrations a step apart, m, shape (T + 1, D) each."""
    axes = list(axes_of(data.task))
    return [path_of(steps)[:, axes] for steps in _taught(data)]


def _taught(data: TaskSet) -> list[tuple[Step, ...]]:
    return [as_performance(own, data.task).steps for own in data.demonstrations]


def _lines_of(data: TaskSet) -> Array:
    """The true direction of each state's line, unit vectors, shape (L, D)."""
    axes = list(axes_of(data.task))
    return unit_rows(np.array([line[-1] - line[0] for line in data.references.values()])[:, axes])


_COUNTING: Mapping[Counting, Callable[[Sequence[Array], np.random.Generator], int]] = {
    "chords": lambda positions, _: len(find_directions(positions).directions),
    "kmeans-cusum": lambda positions, rng: len(
        elbow_directions(positions, rng, most=MOST_DIRECTIONS).directions
    ),
    "silhouette": _silhouette,
}
_FOLLOWING: Mapping[Following, Callable[[TaskSet, np.random.Generator], tuple[Array, Follower]]] = {
    "chapter-3": partial(_by_directions, thesis_settings()),
    "directions": partial(_by_directions, DirectionStateSettings()),
    "hmcs-segment-filter": _segment_filter,
}

DIRECTIONS = Study(
    "directions",
    "how many directions a task of lines has, how soon a change of them is noticed",
    "Aarno 2007, chapter 3",
    DirectionsSettings,
    directions_trial,
    tiny={
        "noise": "0.15",
        "tasks": "1",
        "demonstrations": "3",
        "performances": "1",
        "methods": "chords,silhouette,directions,hmcs-segment-filter",
    },
)
