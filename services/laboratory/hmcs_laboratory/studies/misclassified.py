"""The study of a gesteme level that errs, and what the task level makes of it (4.2)."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from pydantic import AfterValidator

from hmcs.recognition.learning import learn
from hmcs.task.values import unknown_name_message
from hmcs_baselines.observing import Observed
from hmcs_baselines.two_levels import Confusions, LayeredHmmSettings
from hmcs_laboratory.data.hands import NotNegative
from hmcs_laboratory.data.synthetic_tasks import TaskSettings, five_states
from hmcs_laboratory.data.tasks import TaskSet
from hmcs_laboratory.figures.task_following import Followed, follow, names_of
from hmcs_laboratory.study import Measured, Study, seed_from, stream_of

OBSERVED: dict[str, Observed] = {"od-lhmm": "od", "md-lhmm": "md", "fft-lhmm": "fft"}
CONFUSIONS: tuple[Confusions, ...] = ("training", "held-out")


def _known(names: tuple[str, ...]) -> tuple[str, ...]:
    for name in names:
        if name not in OBSERVED:
            raise ValueError(unknown_name_message("method", name, OBSERVED))
    return names


class MisclassifiedSettings(TaskSettings):
    """Of the study `misclassified`."""

    noise: tuple[NotNegative, ...] = (0.15, 0.25)
    """κ of (3.3)."""
    alike_deg: NotNegative | None = 12.0
    """l3 goes so little off l1 that they are confused, and always in the same way."""
    methods: Annotated[tuple[str, ...], AfterValidator(_known)] = tuple(OBSERVED)
    """Layered HMMs by what their gesteme HMMs observe, restarted at given marks."""


def misclassified_trial(
    settings: MisclassifiedSettings, rng: np.random.Generator
) -> list[Measured]:
    """Follow the five-state task by layered HMMs that learned its confusions in two ways."""
    rows = []
    for noise, stream in zip(settings.noise, rng.spawn(len(settings.noise)), strict=True):
        data = five_states(settings, noise, stream)
        seed = seed_from(stream)
        for method in settings.methods:
            for confusions in CONFUSIONS:
                chosen = LayeredHmmSettings(
                    observations=OBSERVED[method], restart="given", confusions=confusions
                )
                began_s = time.thread_time()
                model = learn(
                    data.task,
                    data.demonstrations,
                    chosen,
                    recognizer="lhmm",
                    rng=stream_of(method, seed),
                )
                fit_s = time.thread_time() - began_s
                followed = [follow(model, each) for each in data.performances]
                steps = sum(len(each.steps) for each in data.performances)
                spent_s = time.thread_time() - began_s - fit_s
                times = {"fit_s": fit_s, "us_per_sample": 1e6 * spent_s / steps}
                setting = {"noise": noise, "confusions": confusions}
                rows.append(Measured(method, setting, _measures(followed, data) | times))
    return rows


def _measures(followed: Sequence[Followed], data: TaskSet) -> dict[str, float]:
    """Shares of all steps: winning gesteme right, state right, and states right despite it."""
    truth = np.concatenate([each.states for each in data.performances])
    states = np.concatenate([each.states.argmax(axis=1) for each in followed])
    winners = np.concatenate([each.winners for each in followed])
    gesteme_right = winners == names_of(data).of_state[truth]
    state_right = states == truth
    wrong = ~gesteme_right
    return {
        "gesteme_accuracy": float(gesteme_right.mean()),
        "state_accuracy": float(state_right.mean()),
        "states_right": float(state_right[wrong].mean()) if wrong.any() else float("nan"),
    }


MISCLASSIFIED = Study(
    "misclassified",
    "a gesteme level that errs the same way again and again, and the task level above it",
    "Aarno 2007, 4.2, fig. 4.12; Wolpert 1992",
    MisclassifiedSettings,
    misclassified_trial,
    tiny={"demonstrations": "2", "performances": "1", "noise": "0.15", "methods": "od-lhmm"},
)
