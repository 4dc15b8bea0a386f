"""The figures there are. Adding one is a function that draws it and an entry in `FIGURES`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hmcs.errors import UserError
from hmcs.task.model import unknown
from hmcs_laboratory.figures.figure import Figure
from hmcs_laboratory.figures.trajectories import (
    TaskFigureSettings,
    TrajectorySettings,
    five_state_task,
    typical_trajectories,
)

FIGURES: tuple[Figure[Any], ...] = (
    Figure(
        "4.2",
        "Typical simulated operator trajectories",
        "One trajectory in 2D (left) and one in 3D (right), of lines and arcs of circles in turn; "
        "red dots mark the change from one primitive to the next.",
        typical_trajectories,
        TrajectorySettings(),
    ),
    Figure(
        "4.11",
        "A task with five states and four gestemes",
        "A 2D trajectory of the gestemes l1, c1, l2, c1, l3, one a state. c1 is exactly the same "
        "in S2 and S4, so gesteme classifiers alone cannot tell these states apart.",
        five_state_task,
        TaskFigureSettings(),
    ),
)


def find_figures(numbers: Sequence[str]) -> tuple[Figure[Any], ...]:
    """Return the figures of those numbers, in the order of the thesis; all for none.

    Raises UserError naming all there are for a number that is none.
    """
    known = [figure.number for figure in FIGURES]
    for number in numbers:
        if number not in known:
            raise UserError(unknown("figure", number, known))
    return tuple(figure for figure in FIGURES if not numbers or figure.number in numbers)
