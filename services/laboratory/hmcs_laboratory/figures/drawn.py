"""Human drawings chained to tasks: they stand in where the thesis recorded motion of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from pydantic import Field

from hmcs.arrays import Array
from hmcs.motion.chains import chained
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.lasa import drawings
from hmcs_laboratory.data.hands import Positive
from hmcs_laboratory.data.synthetic_tasks import TRAINED_ORDER, UNSEEN_ORDER
from hmcs_laboratory.data.tasks import TaskSet, as_performance, sequential_task
from hmcs_laboratory.study import StudySettings

Strokes = Annotated[int, Field(ge=1, le=6)]

DRAWINGS = 7
"""Of each shape."""
SHAPES = {"l1": ("Line", 0.0), "l2": ("Line", 90.0), "c1": ("CShape", 0.0)}
"""The shape that stands in for each gesteme, and by how many degrees it is turned."""


class DrawnOrderSettings(StudySettings):
    """Of a task of human drawings performed in a trained and in an unseen order."""

    demonstrations: Strokes = 3
    """Performances to learn from, as in the thesis."""
    performances: Strokes = 2
    """Others to recognize, as in the thesis."""
    taught: Strokes = 4
    """Drawings of each shape that demonstrations are made of, by lot; performances are made of the
    others."""
    dead_zone_m: Positive = 0.0023
    """On the tablet; the thesis resampled to 1 cm."""


def drawn_orders(settings: DrawnOrderSettings, rng: np.random.Generator) -> tuple[TaskSet, TaskSet]:
    """Return the task of figs 4.16 and 4.17 in human drawings, in its trained and unseen order.

    As `six_segments`; both have the same demonstrations.
    """
    task = sequential_task(
        "six-drawn", TRAINED_ORDER, dead_zone_m=settings.dead_zone_m, dimensions=2
    )
    lots = {shape: rng.permutation(DRAWINGS) for shape, _ in SHAPES.values()}
    in_turn = tuple(state.name for state in task.states)
    first = tuple(in_turn[TRAINED_ORDER.index(gesteme)] for gesteme in UNSEEN_ORDER)

    def made(name: str, order: Sequence[str], states: Sequence[str], use: slice) -> Demonstration:
        pieces = [
            _labeled(gesteme, int(rng.choice(lots[SHAPES[gesteme][0]][use])), state)
            for gesteme, state in zip(order, states, strict=True)
        ]
        return chained(name, pieces, np.zeros(3))

    taught, held_out = slice(settings.taught), slice(settings.taught, None)
    demonstrations = tuple(
        made(f"demonstration-{k}", TRAINED_ORDER, in_turn, taught)
        for k in range(settings.demonstrations)
    )
    trained, unseen = (
        tuple(
            as_performance(made(f"{name}-{k}", order, states, held_out), task)
            for k in range(settings.performances)
        )
        for name, order, states in (
            ("trained", TRAINED_ORDER, in_turn),
            ("unseen", UNSEEN_ORDER, first),
        )
    )
    return TaskSet(task, demonstrations, trained, {}), TaskSet(task, demonstrations, unseen, {})


def _labeled(gesteme: str, number: int, state: str) -> Demonstration:
    shape, turn_deg = SHAPES[gesteme]
    time_s, drawn_m = drawings(shape)[number]
    return Demonstration(
        f"{gesteme}/{number + 1}", time_s, turned(drawn_m, turn_deg), (state,) * len(time_s)
    )


def turned(points: Array, turn_deg: float) -> Array:
    """Return points of shape (T, 2) turned about the origin, in space, shape (T, 3)."""
    turn_rad = np.deg2rad(turn_deg)
    cosine, sine = np.cos(turn_rad), np.sin(turn_rad)
    spatial = np.zeros((len(points), 3))
    spatial[:, :2] = points @ np.array([[cosine, sine], [-sine, cosine]])
    return spatial
