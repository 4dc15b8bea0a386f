"""A study of finding gestemes and states in demonstrations that nobody labeled."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from hmcs.arrays import Array
from hmcs.motion.chains import chained
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.lasa import drawings, read_drawing
from hmcs.recognition.discovery.order_cuts import CutSettings
from hmcs.recognition.discovery.task_states import task_states
from hmcs.recognition.discovery.unlabeled import UnlabeledSettings, discover, labeled
from hmcs.recognition.model import axes_of
from hmcs.recognition.segments import LabeledSteps, labeled_steps
from hmcs.task import Task, load_task
from hmcs_baselines.directions import elbow_directions, find_directions
from hmcs_laboratory.agreement import (
    adjusted_rand_index,
    boundaries_of,
    boundary_agreement,
    pooled_agreement,
)
from hmcs_laboratory.data.hands import Count, CurveSettings, NotNegative, Positive
from hmcs_laboratory.data.synthetic_tasks import TaskSettings, five_states
from hmcs_laboratory.data.tasks import path_of
from hmcs_laboratory.study import Measured, Scalar, Study

Integers = NDArray[np.int64]

Data = Literal["five-states", "drawings"]
Name = Literal["hmcs", "hmcs-without-stops", "chords", "kmeans-directions"]


class UnlabeledStudySettings(CurveSettings):
    """Of the study `unlabeled`."""

    data: Annotated[tuple[Data, ...], Field(min_length=1)] = ("five-states", "drawings")
    """The task of fig. 4.11, or five human-drawn shapes one after another in a fixed order."""
    noise: tuple[NotNegative, ...] = (0.05, 0.15, 0.3)
    """κ of (3.3), of the hand that performs the five states."""
    demonstrations: tuple[Count, ...] = (1, 3, 5)
    """How many are given; the first are the same for all."""
    dead_zone_m: Positive = 0.01
    """Of the five states; that of the drawings is their task's."""
    tolerance_steps: NotNegative = 3.0
    """A boundary is found where one is at most so many steps of the dead zone away."""
    methods: tuple[Name, ...] = ()
    """All where none is named."""

    @model_validator(mode="after")
    def _drawings_suffice(self) -> Self:
        there = len(drawings(_shapes()[0])) if "drawings" in self.data else max(self.demonstrations)
        if max(self.demonstrations) > there:
            raise ValueError(
                f"demonstrations={max(self.demonstrations)}: there are {there} drawings of a "
                "shape; ask for fewer, or for data=five-states"
            )
        return self


class _Truth(NamedTuple):
    task: Task
    demonstrations: tuple[Demonstration, ...]
    steps: tuple[LabeledSteps, ...]
    """Of each demonstration, with the true labels."""


class _Found(NamedTuple):
    states: Sequence[Integers]
    """For each demonstration the state of each step."""
    gestemes: Sequence[Integers]


def unlabeled_trial(settings: UnlabeledStudySettings, rng: np.random.Generator) -> list[Measured]:
    """Measure all methods on both tasks, at every noise, with the first so many demonstrations."""
    return list(_measured(settings, rng))


def _measured(settings: UnlabeledStudySettings, rng: np.random.Generator) -> Iterator[Measured]:
    synthetic, drawn = rng.spawn(2)
    if "five-states" in settings.data:
        for noise, stream in zip(settings.noise, synthetic.spawn(len(settings.noise)), strict=True):
            truth = _five_states(settings, noise, stream)
            yield from _on(truth, settings, {"data": "five-states", "noise": noise}, stream)
    if "drawings" in settings.data:
        yield from _on(_drawn(settings, drawn), settings, {"data": "drawings"}, drawn)


def _on(
    truth: _Truth,
    settings: UnlabeledStudySettings,
    setting: Mapping[str, Scalar],
    rng: np.random.Generator,
) -> Iterator[Measured]:
    # Every method begins with the same, whichever others are measured.
    seed = int(rng.integers(2**32))
    for count in settings.demonstrations:
        part = truth._replace(
            demonstrations=truth.demonstrations[:count], steps=truth.steps[:count]
        )
        for name in settings.methods or _METHODS:
            began_s = time.perf_counter()
            found = _METHODS[name](part, np.random.default_rng(seed))
            took_s = time.perf_counter() - began_s
            samples = sum(len(each.positions) for each in part.demonstrations)
            yield Measured(
                name,
                {**setting, "demonstrations": count},
                {
                    **_agreement(part, found, settings.tolerance_steps),
                    "fit_s": took_s,
                    "us_per_sample": 1e6 * took_s / samples,
                },
            )


def _agreement(truth: _Truth, found: _Found, tolerance_steps: float) -> dict[str, float]:
    true = [each.states for each in truth.steps]
    boundaries = pooled_agreement(
        [
            boundary_agreement(boundaries_of(own), boundaries_of(other), tolerance_steps)
            for own, other in zip(true, found.states, strict=True)
        ]
    )
    states, gestemes = np.concatenate(found.states), np.concatenate(found.gestemes)
    true_gestemes = np.concatenate([each.gestemes for each in truth.steps])
    return {
        "adjusted_rand": adjusted_rand_index(np.concatenate(true), states),
        "gesteme_adjusted_rand": adjusted_rand_index(true_gestemes, gestemes),
        "boundary_f": boundaries.f_score,
        "gestemes_right": float(len(np.unique(gestemes)) == len(truth.task.gestemes)),
        "states_right": float(len(np.unique(states)) == len(truth.task.states)),
    }


def _five_states(
    settings: UnlabeledStudySettings, noise: float, rng: np.random.Generator
) -> _Truth:
    made = five_states(
        TaskSettings(
            **settings.model_dump(include=set(CurveSettings.model_fields)),
            demonstrations=max(settings.demonstrations),
            performances=1,
            dead_zone_m=settings.dead_zone_m,
        ),
        noise,
        rng,
    )
    return _truth(made.task, made.demonstrations)


def _drawn(settings: UnlabeledStudySettings, rng: np.random.Generator) -> _Truth:
    """The shapes of the shipped task one after another, a drawing of each drawn by lot."""
    task, shapes = load_task("human-shapes"), _shapes()
    lots = [1 + rng.permutation(len(drawings(shape))) for shape in shapes]
    rounds = [
        [read_drawing(shape, int(lot[k]), task) for shape, lot in zip(shapes, lots, strict=True)]
        for k in range(max(settings.demonstrations))
    ]
    return _truth(
        task, [chained(f"round-{k}", own, np.zeros(3)) for k, own in enumerate(rounds, start=1)]
    )


def _shapes() -> tuple[str, ...]:
    return tuple(gesteme.name for gesteme in load_task("human-shapes").gestemes)


def _truth(task: Task, demonstrations: Sequence[Demonstration]) -> _Truth:
    steps = tuple(labeled_steps(task, each) for each in demonstrations)
    return _Truth(task, tuple(demonstrations), steps)


def _ours(truth: _Truth, stops: bool) -> _Found:
    discovery = discover(truth.demonstrations, UnlabeledSettings(cut=CutSettings(stops=stops)))
    task, demonstrations = labeled(discovery, truth.demonstrations, truth.task)
    steps = [labeled_steps(task, each) for each in demonstrations]
    return _Found([each.states for each in steps], [each.gestemes for each in steps])


def _chords(truth: _Truth, _rng: np.random.Generator) -> _Found:
    """Every run of steps along one line is a piece, the line its gesteme."""
    labels = find_directions(_stepped(truth)).labels
    states = task_states([np.array([line for line, _ in groupby(own)]) for own in labels])
    runs = [np.cumsum(np.append(False, own[1:] != own[:-1])) for own in labels]
    return _Found(
        [sequence[run] for sequence, run in zip(states.sequences, runs, strict=True)], labels
    )


def _kmeans(truth: _Truth, rng: np.random.Generator) -> _Found:
    """Every direction is a gesteme and a state, as in chapter 3."""
    labels = elbow_directions(_stepped(truth), rng).labels
    return _Found(labels, labels)


def _stepped(truth: _Truth) -> list[Array]:
    axes = list(axes_of(truth.task))
    return [path_of(steps)[:, axes] for steps, _, _ in truth.steps]


_METHODS: Mapping[Name, Callable[[_Truth, np.random.Generator], _Found]] = {
    "hmcs": lambda truth, _: _ours(truth, stops=True),
    "hmcs-without-stops": lambda truth, _: _ours(truth, stops=False),
    "chords": _chords,
    "kmeans-directions": _kmeans,
}

UNLABELED = Study(
    "unlabeled",
    "gestemes and states found in demonstrations without labels",
    "Aarno 2007, chapters 3 and 5; Hubert and Arabie 1985",
    UnlabeledStudySettings,
    unlabeled_trial,
    tiny={
        "noise": "0.1",
        "demonstrations": "2",
        "data": "five-states",
        "methods": "hmcs,chords",
    },
)
