"""What the help is worth: laws, tasks and operators, each against the operator alone."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Annotated

import numpy as np
from pydantic import AfterValidator

from hmcs.motion.closed_loop_operators import PRESETS, ClosedLoopOperator
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.registry import kind_named, settings_of
from hmcs.recognition.segments import LearningError
from hmcs_laboratory.assistance.laws import DEFAULT_LAW, LAWS, AssistLaw
from hmcs_laboratory.assistance.loop import Run, assisted, demonstrated
from hmcs_laboratory.assistance.measures import measures
from hmcs_laboratory.assistance.robots import LAG
from hmcs_laboratory.assistance.scenarios import (
    FAMILIES,
    TASKS,
    AssistedTask,
    Scenario,
    Taught,
)
from hmcs_laboratory.data.hands import Count, NotNegative, Positive
from hmcs_laboratory.study import Measured, Study, StudySettings, known_once, seed_from

UNAIDED = "none"
MOST_S_PER_M = 120.0
"""An operator slower than this has failed."""
RATIOS = {
    "error_mm": "error_ratio",
    "max_error_mm": "max_error_ratio",
    "time_s": "time_ratio",
    "leave_s": "leave_ratio",
    "hand_path_m": "effort_ratio",
}
"""Measures that are given as a ratio to the operator alone, too."""


def _names(what: str, choices: Sequence[str]) -> AfterValidator:
    return AfterValidator(lambda names: known_once(what, names, choices))


LawNames = Annotated[tuple[str, ...], _names("law", [law.name for law in LAWS])]


class LoopSettings(StudySettings):
    """Who is helped how."""

    law: LawNames = ()
    """Laws to measure; all where none is named. The operator alone is always measured."""
    operator: Annotated[tuple[str, ...], _names("operator", list(PRESETS))] = ("steady",)
    """Simulated operators, by name."""
    demonstrations: Count = 5
    """Performances, by the same operator alone, that a model is learned from."""
    dead_zone_m: Positive = 0.005
    """Of the recognizer."""
    rate_hz: Positive = 100.0
    """Samples of the hand and ticks of the fixture a second."""
    robot: str = LAG
    """`lag` is a tool that follows with a delay, `physics` the task's arm among its obstacles."""
    robot_lag_s: NotNegative = 0.03
    """Time constant of `lag`."""


class AssistanceSettings(LoopSettings):
    """Who is helped how, and in what."""

    task: Annotated[tuple[str, ...], _names("task", list(TASKS))] = ()
    """All where none is named."""


class Lesson:
    """What one operator was taught, and the models learned from it."""

    def __init__(self, settings: LoopSettings, family: str, operator: str, seed: int) -> None:
        self._settings = settings
        self._models: dict[tuple[str, float], tuple[Model, float] | None] = {}
        taught_rng, *streams = (
            np.random.default_rng([seed, n]) for n in range(settings.demonstrations + 1)
        )
        self.taught = FAMILIES[family](taught_rng, settings.dead_zone_m)
        period_s = 1.0 / settings.rate_hz
        self._demonstrations = [
            demonstrated(
                ClosedLoopOperator(PRESETS[operator], self.taught.path, stream, period_s=period_s),
                self.taught,
                f"demonstration-{k}",
                period_s=period_s,
                most_s=MOST_S_PER_M * self.taught.path.length_m,
            )
            for k, stream in enumerate(streams, start=1)
        ]

    def model(self, law: AssistLaw) -> tuple[Model, float] | None:
        """The law's model and what learning took, s; None where it cannot learn from this."""
        dead_zone_m = law.dead_zone_m or self._settings.dead_zone_m
        key = (law.recognizer, dead_zone_m)
        if key not in self._models:
            task = self.taught.task.model_copy(update={"dead_zone_m": dead_zone_m})
            chosen = settings_of(kind_named(law.recognizer), law.recognizer_settings)
            began_s = time.thread_time()
            try:
                model = learn(task, self._demonstrations, chosen, recognizer=law.recognizer)
            except LearningError:
                self._models[key] = None
            else:
                self._models[key] = (model, time.thread_time() - began_s)
        return self._models[key]


def assistance_trial(settings: AssistanceSettings, rng: np.random.Generator) -> list[Measured]:
    """Measure every law with every operator in every task."""
    tasks = {name: task for name, task in TASKS.items() if name in (settings.task or TASKS)}
    return measured_in(tasks, settings, rng)


def measured_in(
    tasks: Mapping[str, AssistedTask], settings: LoopSettings, rng: np.random.Generator
) -> list[Measured]:
    """Measure every law with every operator in these tasks.

    Operator, workspace and noise are the same for all laws.
    """
    rows: list[Measured] = []
    wanted = [law for law in LAWS if law.name in (*settings.law, UNAIDED) or not settings.law]
    for operator in settings.operator:
        seed = seed_from(rng)
        lessons: dict[str, Lesson] = {}
        for index, (name, task) in enumerate(tasks.items()):
            if task.family not in lessons:
                lessons[task.family] = Lesson(settings, task.family, operator, seed)
            lesson = lessons[task.family]
            scenario = task.meaning(lesson.taught, np.random.default_rng([seed, 1000 + index]))
            alone: dict[str, float] = {}
            for law in wanted:
                known = lesson.model(law)
                what = {"law": law.name, "task": name, "operator": operator}
                if known is None:
                    rows.append(Measured(law.name, {**what, **_default(law)}, _nothing()))
                    continue
                run, spent_s = performed(
                    settings, lesson.taught, scenario, law, known[0], operator, seed
                )
                measured = measures(run, scenario)
                if law.name == UNAIDED:
                    alone = measured
                ratios = {
                    ratio: measured[of] / alone[of]
                    for of, ratio in RATIOS.items()
                    if of in measured and alone[of] > 0
                }
                times = {"fit_s": known[1], "us_per_sample": 1e6 * spent_s / len(run.robot)}
                rows.append(
                    Measured(law.name, {**what, **_default(law)}, {**ratios, **measured, **times})
                )
    return rows


def performed(
    settings: LoopSettings,
    taught: Taught,
    scenario: Scenario,
    law: AssistLaw,
    model: Model,
    operator: str,
    seed: int,
) -> tuple[Run, float]:
    """Return how an operator performs a scenario under a law, and the processor time, s.

    With equal seeds the hand errs alike whatever the law.
    """
    period_s = 1.0 / settings.rate_hz
    hand = ClosedLoopOperator(
        PRESETS[operator],
        scenario.meant,
        np.random.default_rng([seed, 2000]),
        period_s=period_s,
    )
    began_s = time.thread_time()
    run = assisted(
        hand,
        taught,
        scenario,
        model,
        law.rules(taught.task),
        robot=settings.robot,
        robot_lag_s=settings.robot_lag_s,
        period_s=period_s,
        most_s=MOST_S_PER_M * scenario.meant.length_m,
    )
    return run, time.thread_time() - began_s


def _default(law: AssistLaw) -> dict[str, int]:
    return {"default_law": int(law.name == DEFAULT_LAW)}


def _nothing() -> dict[str, float]:
    return dict.fromkeys(("error_ratio", "time_ratio", "fighting"), float("nan"))


ASSISTANCE = Study(
    "assistance",
    "what each fixture law is worth: path error, time, fighting, leaving, tremor",
    "Aarno 2007, 2.2 and 3.3; Marayong 2002; Nolin 2003",
    AssistanceSettings,
    assistance_trial,
    tiny={"law": "insistence", "task": "lines", "demonstrations": "2"},
    table=(
        "law",
        "task",
        "operator",
        "error_ratio",
        "max_error_ratio",
        "time_ratio",
        "fighting",
        "leave_ratio",
        "hits",
        "tremor_left",
    ),
    picture="hmcs_laboratory.figures.assistance:picture_of",
)
