"""Methods that follow a task step by step."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.recognizer import Recognizer
from hmcs.recognition.scoring import pooled, score
from hmcs.task import Task
from hmcs_laboratory.data.tasks import Performance, TaskSet

Fresh = Callable[[], Recognizer]
"""Returns a recognizer that has learned and has seen no step yet."""


@dataclass(frozen=True)
class OnlineMethod:
    """A method under the name by which studies list it."""

    name: str
    source: str
    learn: Callable[[Task, Sequence[Demonstration], np.random.Generator], Fresh]
    """Raises UserError where its library is not installed."""
    marked: bool = False
    """Whether it is given where a segment begins; all others have to find out."""


@dataclass(frozen=True)
class Learned:
    """A method that has learned a task."""

    method: OnlineMethod
    fresh: Fresh
    fit_s: float
    """Processor time of one thread."""


@dataclass(frozen=True)
class Followed:
    """What a method believed of the performances of a task."""

    beliefs: tuple[Array, ...]
    """Of each performance the probability of each state after each step, shape (T, S)."""
    times: dict[str, float]
    """`fit_s` and `us_per_sample`, processor time of one thread."""


def learned(method: OnlineMethod, data: TaskSet, rng: np.random.Generator) -> Learned:
    """Learn from the demonstrations of a task."""
    began_s = time.thread_time()
    fresh = method.learn(data.task, data.demonstrations, rng)
    return Learned(method, fresh, time.thread_time() - began_s)


def followed(what: Learned, performances: Sequence[Performance]) -> Followed:
    """Follow every performance, step by step, each from the beginning of the task."""
    beliefs, spent_s = [], 0.0
    for performance in performances:
        recognizer = what.fresh()
        shown = performance if what.method.marked else performance.unmarked()
        began_s = time.thread_time()
        states = [recognizer.step(step).belief.states for step in shown.steps]
        spent_s += time.thread_time() - began_s
        beliefs.append(np.array(states))
    count = sum(len(performance.steps) for performance in performances)
    return Followed(tuple(beliefs), {"fit_s": what.fit_s, "us_per_sample": 1e6 * spent_s / count})


def state_measures(what: Followed, performances: Sequence[Performance]) -> dict[str, float]:
    """Return `state_accuracy`, delay and false switches of task states, and the times."""
    believed = [belief.argmax(axis=1) for belief in what.beliefs]
    measures = switch_measures("state_accuracy", [p.states for p in performances], believed)
    return {**measures, **what.times}


def gesteme_measures(what: Followed, data: TaskSet) -> dict[str, float]:
    """Return `gesteme_accuracy`, delay and false switches of gestemes, and the times.

    A gesteme is as probable as all the states it is performed in.
    """
    gesteme = data.gesteme_of_state
    shares = np.eye(gesteme.max() + 1)[gesteme]
    believed = [(belief @ shares).argmax(axis=1) for belief in what.beliefs]
    true = [gesteme[performance.states] for performance in data.performances]
    measures = switch_measures("gesteme_accuracy", true, believed)
    return {**measures, **what.times}


def switch_measures(
    accuracy: str, true: Sequence[NDArray[np.int64]], believed: Sequence[NDArray[np.int64]]
) -> dict[str, float]:
    """Return the accuracy under that name, `delay_p95_steps` and `false_switches_per_1000`.

    Of all performances as if they were one, without a switch from one to the next.
    """
    scores = pooled([score(*pair) for pair in zip(true, believed, strict=True)])
    return {
        accuracy: scores.accuracy,
        "delay_p95_steps": scores.switch_delay(95),
        "false_switches_per_1000": scores.false_switches_per_1000_steps,
    }
