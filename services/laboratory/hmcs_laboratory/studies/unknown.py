"""A study of unknown intent: is motion that is no part of the task recognized as such?"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field
from sklearn.metrics import roc_auc_score

from hmcs.arrays import Array
from hmcs.motion.steps import Step, steps_of
from hmcs.recognition.learning import learn
from hmcs.recognition.recognizer import Recognition
from hmcs.recognition.registry import recognizer_of
from hmcs.recognition.segment_filter.recognizer import segment_filter_model
from hmcs_laboratory.data.drawn_tasks import fixed_order
from hmcs_laboratory.data.hands import Count, NotNegative, Positive
from hmcs_laboratory.data.synthetic_tasks import TaskSettings, five_states
from hmcs_laboratory.data.tasks import TaskSet
from hmcs_laboratory.data.unknown_motions import (
    Reaches,
    Smooth,
    after,
    other_drawings,
    random_reaches,
    smooth_motion,
)
from hmcs_laboratory.methods.online import Fresh
from hmcs_laboratory.methods.online_peers import learn_concatenated_hmm
from hmcs_laboratory.study import Measured, Scalar, Study, seed_from, stream_of

Data = Literal["five-states", "drawings"]
UnknownMotion = Literal["shapes", "smooth", "reaches"]
Name = Literal["hmcs-segment-filter", "concatenated-hmm"]

WINDOW_STEPS = 20
"""Of the peer, which has no alarm of its own."""


class UnknownSettings(TaskSettings):
    """Of the study `unknown`.

    Each performance is followed to its half, and then the hand does something else.
    """

    data: Annotated[tuple[Data, ...], Field(min_length=1)] = ("five-states", "drawings")
    """The task of fig. 4.11, which another random task of that kind is unknown to; or five
    human-drawn shapes in a fixed order."""
    noise: tuple[NotNegative, ...] = (0.15, 0.3)
    """κ of (3.3), of the hand that performs the five states."""
    motions: Annotated[tuple[UnknownMotion, ...], Field(min_length=1)] = (
        "shapes",
        "smooth",
        "reaches",
    )
    """Unknown to the drawings: other shapes, smooth random motion, or reaches at random."""
    training: Annotated[int, Field(ge=1, le=5)] = 5
    """Drawings of each shape to learn from; the task is performed with two others."""
    drawings_dead_zone_m: Positive = 0.0023
    """On the tablet."""
    unknown_m: Positive = 0.5
    """Length of smooth motion and of reaches, m on the tablet."""
    unknown_shapes: Count = 5
    """Other shapes that are drawn one after another."""
    methods: tuple[Name, ...] = ()
    """All where none is named."""


class _Question(NamedTuple):
    """A task, motion of it and motion that is none of it."""

    data: TaskSet
    unknown: tuple[tuple[Step, ...], ...]
    """Each is made instead of the second half of a performance."""


class _Method(NamedTuple):
    """A method that has learned a task."""

    fresh: Fresh
    window_steps: int
    fits: Callable[[Sequence[Recognition]], Array]
    """How well the window that ends with each step fits the task, shape (T,); more is better."""
    alarms: bool
    """Whether it says by itself that motion is unknown."""


class _Watched(NamedTuple):
    """Windows of one kind of motion, of several performances."""

    fits: Array
    alarms: Array
    unknown: Array
    """P(no part of the task) after each."""


def unknown_trial(settings: UnknownSettings, rng: np.random.Generator) -> list[Measured]:
    """Measure all methods on both tasks."""
    synthetic, drawn = rng.spawn(2)
    rows: list[Measured] = []
    if "five-states" in settings.data:
        for noise, stream in zip(settings.noise, synthetic.spawn(len(settings.noise)), strict=True):
            data = five_states(settings, noise, stream)
            other = five_states(settings, noise, stream)
            questions = {"another-task": _Question(data, _motions_of(other))}
            setting: dict[str, Scalar] = {"data": "five-states", "noise": noise}
            rows += _measured(questions, settings, setting, seed_from(stream))
    if "drawings" in settings.data:
        rows += _measured(_drawn(settings, drawn), settings, {"data": "drawings"}, seed_from(drawn))
    return rows


def _motions_of(data: TaskSet) -> tuple[tuple[Step, ...], ...]:
    return tuple(performance.steps for performance in data.performances)


def _drawn(settings: UnknownSettings, rng: np.random.Generator) -> dict[str, _Question]:
    task_rng, *streams = rng.spawn(1 + len(settings.motions))
    zone_m = settings.drawings_dead_zone_m
    data = fixed_order(settings.training, 2, zone_m, task_rng)
    return {
        motion: _Question(
            data,
            tuple(
                tuple(steps_of(_MOTIONS[motion](settings, data, stream), zone_m))
                for _ in range(settings.performances)
            ),
        )
        for motion, stream in zip(settings.motions, streams, strict=True)
    }


def _measured(
    questions: Mapping[str, _Question],
    settings: UnknownSettings,
    setting: Mapping[str, Scalar],
    seed: int,
) -> Iterator[Measured]:
    data = next(iter(questions.values())).data
    for name, learned in _METHODS.items():
        if settings.methods and name not in settings.methods:
            continue
        began_s = time.thread_time()
        method = learned(data, stream_of(name, seed))
        fit_s = time.thread_time() - began_s
        known = [performance.unmarked().steps for performance in data.performances]
        began_s = time.thread_time()
        of_task = _pooled([_watched(method, steps, 0) for steps in known])
        us_per_sample = 1e6 * (time.thread_time() - began_s) / sum(map(len, known))
        for motion, question in questions.items():
            of_unknown = _pooled(
                [
                    _watched(method, (*lead, *after(lead, steps)), len(lead))
                    for k, steps in enumerate(question.unknown)
                    for lead in [known[k % len(known)][: len(known[k % len(known)]) // 2]]
                ]
            )
            yield Measured(
                name,
                {**setting, "unknown": motion},
                {
                    **_measures(method, of_task, of_unknown),
                    "fit_s": fit_s,
                    "us_per_sample": us_per_sample,
                },
            )


def _measures(method: _Method, of_task: _Watched, of_unknown: _Watched) -> dict[str, float]:
    fits = np.concatenate([of_task.fits, of_unknown.fits])
    is_task = np.arange(len(fits)) < len(of_task.fits)
    measures = {"auc": float(roc_auc_score(is_task, fits))}
    if method.alarms:
        measures |= {
            "false_alarms": float(of_task.alarms.mean()),
            "detected": float(of_unknown.alarms.mean()),
            "unknown_in_task": float(of_task.unknown.mean()),
            "unknown_in_unknown": float(of_unknown.unknown.mean()),
        }
    return measures


def _watched(method: _Method, steps: Sequence[Step], begin: int) -> _Watched:
    """Follow a whole motion; watch the windows that lie within its steps from `begin` on."""
    recognizer = method.fresh()
    recognitions = [recognizer.step(step) for step in steps]
    full = slice(begin + method.window_steps - 1, None)
    return _Watched(
        method.fits(recognitions)[full],
        np.array([each.unknown_alarm for each in recognitions])[full],
        np.array([each.belief.unknown for each in recognitions])[full],
    )


def _pooled(windows: Sequence[_Watched]) -> _Watched:
    return _Watched(*(np.concatenate(column) for column in zip(*windows, strict=True)))


def _segment_filter(data: TaskSet, rng: np.random.Generator) -> _Method:
    model = learn(data.task, data.demonstrations, rng=rng)
    return _Method(
        lambda: recognizer_of(model),
        segment_filter_model(model).alarm.window_steps,
        lambda beliefs: np.array([each.mean_log_likelihood for each in beliefs]),
        alarms=True,
    )


def _concatenated(data: TaskSet, rng: np.random.Generator) -> _Method:
    """The mean log-likelihood of a plain HMM over as many steps."""

    def fits(recognitions: Sequence[Recognition]) -> Array:
        sums = np.cumsum([0.0, *(each.belief.log_likelihood for each in recognitions)])
        ends = np.arange(1, len(sums))
        begins = np.maximum(ends - WINDOW_STEPS, 0)
        return np.asarray((sums[ends] - sums[begins]) / (ends - begins))

    fresh = learn_concatenated_hmm(data.task, data.demonstrations, rng)
    return _Method(fresh, WINDOW_STEPS, fits, alarms=False)


_MOTIONS: Mapping[
    UnknownMotion, Callable[[UnknownSettings, TaskSet, np.random.Generator], Array]
] = {
    "shapes": lambda settings, data, rng: other_drawings(
        [gesteme.name for gesteme in data.task.gestemes], settings.unknown_shapes, rng
    ),
    "smooth": lambda settings, _, rng: smooth_motion(Smooth(), settings.unknown_m, rng),
    "reaches": lambda settings, _, rng: random_reaches(Reaches(), settings.unknown_m, rng),
}
_METHODS: Mapping[Name, Callable[[TaskSet, np.random.Generator], _Method]] = {
    "hmcs-segment-filter": _segment_filter,
    "concatenated-hmm": _concatenated,
}

UNKNOWN = Study(
    "unknown",
    "motion that is no part of the task recognized as such",
    "Aarno 2007, section 4.3",
    UnknownSettings,
    unknown_trial,
    tiny={
        "noise": "0.15",
        "demonstrations": "2",
        "performances": "1",
        "training": "2",
        "drawings_dead_zone_m": "0.008",
        "unknown_m": "0.2",
        "motions": "reaches",
        "methods": "hmcs-segment-filter,concatenated-hmm",
    },
)
