"""Choosing a recognizer's settings by what it says of demonstrations it was not learned from.

The thesis leaves the number of states, of symbols, the emission open (2.1.2, optimization of the
HMM parameters). Here each choice is judged by the held-out likelihood of the labels: the mean log
probability given to the true state at every step of a demonstration left out of learning. Unlike
the likelihood of the observations it can be compared between any two settings, also between
symbols and densities, and between kinds of recognizers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.registry import kind_named, recognizer_of, settings_of
from hmcs.recognition.segments import LearningError, labeled_steps
from hmcs.task import Task

SURE_ENOUGH = 1e-3
"""No true state is held to be less probable than this: one surprise must not decide alone."""


class Judged(NamedTuple):
    """What one choice of settings was worth."""

    chosen: Mapping[str, str]
    """The settings that vary, as text."""
    log_probability: float
    """Mean over all labeled steps of the demonstrations left out, nats a step; higher is better."""
    spread: float
    """Standard error of it over demonstrations."""


class Selection(NamedTuple):
    """The choice made, and all that were judged."""

    settings: Any
    """Of the recognizer's own type."""
    judged: tuple[Judged, ...]
    """The best first."""


def choose(
    task: Task,
    demonstrations: Sequence[Demonstration],
    choices: Mapping[str, Sequence[str]],
    *,
    recognizer: str,
    given: Mapping[str, str] | None = None,
    seed: int = 0,
    progress: Callable[[int, int], None] = lambda _done, _all: None,
) -> Selection:
    """Judge every combination of `choices` by leaving out each demonstration in turn.

    A demonstration is left out only where all gestemes are still demonstrated without it. Of
    choices that are as good (within the best one's standard error) the first in the order given
    wins, so put what is cheaper first. `progress` receives how many of all fits are done.

    Raises LearningError when no demonstration can be left out; UserError for an unknown setting
    or a value that does not fit.
    """
    kind = kind_named(recognizer)
    fixed = dict(given or {})
    combinations = [
        dict(zip(choices, values, strict=True)) for values in product(*choices.values())
    ]
    all_settings = [settings_of(kind, fixed | chosen) for chosen in combinations]
    folds = _folds(task, demonstrations)
    done, total = 0, len(combinations) * len(folds)
    judged: list[Judged] = []
    for chosen, settings in zip(combinations, all_settings, strict=True):
        means, weights = [], []
        for kept, left in folds:
            model = learn(
                task, kept, settings, recognizer=recognizer, rng=np.random.default_rng(seed)
            )
            log_probabilities = _log_probabilities(model, left)
            means.append(float(log_probabilities.mean()))
            weights.append(len(log_probabilities))
            done += 1
            progress(done, total)
        spread = float(np.std(means, ddof=1) / np.sqrt(len(means))) if len(means) > 1 else 0.0
        judged.append(Judged(chosen, float(np.average(means, weights=weights)), spread))
    best = max(judged, key=lambda each: each.log_probability)
    good = [each.log_probability >= best.log_probability - best.spread for each in judged]
    return Selection(
        all_settings[good.index(True)],
        tuple(sorted(judged, key=lambda each: -each.log_probability)),
    )


def _folds(
    task: Task, demonstrations: Sequence[Demonstration]
) -> list[tuple[list[Demonstration], Demonstration]]:
    shown = [set(labeled_steps(task, each).gestemes) - {-1} for each in demonstrations]
    wanted = set(range(len(task.gestemes)))
    folds = [
        ([*demonstrations[:k], *demonstrations[k + 1 :]], left)
        for k, left in enumerate(demonstrations)
        if set().union(*shown[:k], *shown[k + 1 :]) >= wanted
    ]
    if not folds:
        raise LearningError(
            f"no demonstration of task {task.name!r} can be left out without leaving a gesteme "
            "undemonstrated: give every gesteme two demonstrations, or train without choosing"
        )
    return folds


def _log_probabilities(model: Model, left: Demonstration) -> NDArray[np.float64]:
    """Log probability of the true state at each labeled step, shape (T,)."""
    steps, states, _ = labeled_steps(model.task, left)
    # What is left out may be one gesteme alone: it may begin in any state.
    recognizer = recognizer_of(model, anywhere=True)
    believed = np.array([recognizer.step(step).belief.states for step in steps])
    labeled = np.flatnonzero(states >= 0)
    right = believed[labeled, states[labeled]]
    return np.asarray(np.log(np.maximum(right, SURE_ENOUGH)))
