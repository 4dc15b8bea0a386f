"""The two tasks of section 4.3, on a robot led by its tool: recognized, and assisted."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from hmcs.recognition.scoring import NONE, score
from hmcs.task import Task
from hmcs_laboratory.assistance.laws import DEFAULT_LAW, LAWS, AssistLaw
from hmcs_laboratory.assistance.loop import Run
from hmcs_laboratory.assistance.measures import measures
from hmcs_laboratory.assistance.scenarios import (
    AssistedTask,
    Scenario,
    Taught,
    as_taught,
    state_at,
    unseen_order,
)
from hmcs_laboratory.data.hands import Count, Positive
from hmcs_laboratory.studies.assistance import UNAIDED, Lesson, LoopSettings, performed
from hmcs_laboratory.study import Measured, Study, seed_from

FREE, ASSISTED = (next(law for law in LAWS if law.name == name) for name in (UNAIDED, DEFAULT_LAW))


class ForceTaskSettings(LoopSettings):
    """Who leads the robot by its tool, and what is learned from."""

    demonstrations: Count = 3
    """As in the thesis, which tested on two others."""
    performances: Count = 2
    """Others, in which it is measured."""
    dead_zone_m: Positive = 0.01
    """As in the thesis, which normalized samples to be so far apart."""
    robot: str = "physics"
    """`physics` is the task's arm among its obstacles, `lag` a tool that follows with a delay."""
    symbols: Count = 10
    """Of chapter 4's recognizer; as in the thesis 10 in the plane and 25 in space."""


class ObjectSettings(ForceTaskSettings):
    """Who leads the robot around the object."""

    symbols: Count = 25
    """Of chapter 4's recognizer; as in the thesis 25 in space."""


SURFACE = {
    "trained order": AssistedTask("surface", as_taught),
    "unseen order": AssistedTask("surface", unseen_order),
}
OBJECT = {"trained order": AssistedTask("object", as_taught)}


def force_task_trial(
    tasks: dict[str, AssistedTask], settings: ForceTaskSettings, rng: np.random.Generator
) -> list[Measured]:
    """Measure the operator alone and assisted, followed by our recognizer and chapter 4's."""
    rows: list[Measured] = []
    followed = {
        "segment-filter": FREE,
        "lhmm": AssistLaw(
            FREE.name,
            FREE.source,
            FREE.fixture,
            "lhmm",
            {"observing.symbols": str(settings.symbols)},
        ),
    }
    for operator in settings.operator:
        seed = seed_from(rng)
        family = next(iter(tasks.values())).family
        lesson = Lesson(settings, family, operator, seed)
        for order, task in tasks.items():
            for k in range(settings.performances):
                hand = seed_from(np.random.default_rng([seed, k]))
                scenario = task.meaning(lesson.taught, np.random.default_rng([hand, 1]))
                alone: dict[str, float] = {}
                for name, law in (*followed.items(), ("segment-filter", ASSISTED)):
                    known = lesson.model(law)
                    if known is None:
                        continue
                    run, spent_s = performed(
                        settings, lesson.taught, scenario, law, known[0], operator, hand
                    )
                    measured = measures(run, scenario)
                    alone = alone or measured
                    rows.append(
                        Measured(
                            f"{name}, {law.name}",
                            {"recognizer": name, "law": law.name, "order": order},
                            {
                                **recognized(run, scenario, lesson.taught),
                                "error_ratio": measured["error_mm"] / alone["error_mm"],
                                "time_ratio": measured["time_s"] / alone["time_s"],
                                **measured,
                                "fit_s": known[1],
                                "us_per_sample": 1e6 * spent_s / len(run.robot),
                            },
                        )
                    )
    return rows


def recognized(run: Run, scenario: Scenario, taught: Taught) -> dict[str, float]:
    """Return how well the gesteme was known while it was made.

    In an order that was never taught only gestemes are true, states are not.
    """
    states, ends_m = scenario.states or taught.states, scenario.ends_m
    ends_m = taught.ends_m if ends_m is None else ends_m
    progress_m = np.maximum.accumulate(run.progress_m)
    true = [state_at(states, ends_m, float(progress_m[at])) for at in run.step_at]
    # What is believed after a step is reported from the next sample on.
    after = np.minimum(run.step_at + 1, len(run.states) - 1)
    believed = [run.states[at] for at in after]
    scores = score(_gestemes(taught.task, true), _gestemes(taught.task, believed))
    return {
        "accuracy": scores.accuracy,
        "delay_steps": scores.switch_delay(50),
        "false_switches": float(scores.false_switches),
    }


def _gestemes(task: Task, states: list[str]) -> NDArray[np.int64]:
    """Index of each state's gesteme; NONE where there is no state."""
    names = [gesteme.name for gesteme in task.gestemes]
    of_state = {state.name: names.index(state.gestemes[0]) for state in task.states}
    return np.array([of_state.get(state, NONE) for state in states], dtype=np.int64)


_TABLE = (
    "recognizer",
    "law",
    "order",
    "accuracy",
    "delay_steps",
    "false_switches",
    "error_ratio",
    "error_mm",
    "time_ratio",
    "collisions",
)
_TINY = {"demonstrations": "2", "performances": "1", "robot": "lag"}

FORCE_TASK_2D = Study(
    "force-task-2d",
    "strokes on a surface with a robot led by its tool, in a trained and an unseen order",
    "Aarno 2007, 4.3, figs 4.15 to 4.17",
    ForceTaskSettings,
    partial(force_task_trial, SURFACE),
    trials=5,
    tiny=_TINY,
    table=_TABLE,
)
FORCE_TASK_3D = Study(
    "force-task-3d",
    "a way around an object with a robot led by its tool",
    "Aarno 2007, 4.3, figs 4.13 and 4.15",
    ObjectSettings,
    partial(force_task_trial, OBJECT),
    trials=5,
    tiny=_TINY,
    table=_TABLE,
)
