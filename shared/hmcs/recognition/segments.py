"""Segments: demonstrations cut at their labels, one performance of one gesteme each."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import Step, steps_of
from hmcs.task import Task

Array = NDArray[np.float64]


class LearningError(UserError):
    """Demonstrations that a model cannot be learned from; says which, why, and what to do."""


class Segment(NamedTuple):
    """One performance of one gesteme."""

    demonstration: str
    gesteme: int
    positions: Array
    """m, shape (T, 3)."""
    steps: tuple[Step, ...]


def segments_of(task: Task, demonstrations: Sequence[Demonstration]) -> list[Segment]:
    """Cut demonstrations at their labels.

    A label is a state's name, or `state/gesteme` where a state has several gestemes; unlabeled
    stretches are left out. Raises LearningError as `learn`.
    """
    if not demonstrations:
        raise LearningError(f"no demonstrations of task {task.name!r}: give at least one")
    segments = []
    for demonstration in demonstrations:
        labeled = False
        for label, run in groupby(
            range(len(demonstration.positions)), key=demonstration.states.__getitem__
        ):
            if label is None:
                continue
            labeled = True
            samples = list(run)
            # A segment ends where the next begins: the sample that opens the next closes this one.
            stop = min(samples[-1] + 2, len(demonstration.positions))
            positions = demonstration.positions[samples[0] : stop]
            steps = tuple(steps_of(positions, task.dead_zone_m))
            if len(steps) < 2:
                raise LearningError(
                    f"demonstration {demonstration.name!r}: the stretch labeled {label!r} from "
                    f"{demonstration.time_s[samples[0]]:.2f} s on moves "
                    f"{_extent(positions):.4f} m and makes {len(steps)} steps, but 2 are "
                    f"needed: demonstrate it larger or lower dead_zone_m ({task.dead_zone_m})"
                )
            gesteme = _gesteme_of(task, label, demonstration.name)
            segments.append(Segment(demonstration.name, gesteme, positions, steps))
        if not labeled:
            raise LearningError(
                f"demonstration {demonstration.name!r} has no labels: add a column 'state' with "
                f"one of {', '.join(state.name for state in task.states)}"
            )
    return segments


def _gesteme_of(task: Task, label: str, demonstration: str) -> int:
    names = [gesteme.name for gesteme in task.gestemes]
    state_name, _, chosen = label.partition("/")
    state = next((s for s in task.states if s.name == state_name), None)
    if state is None:
        raise LearningError(
            f"demonstration {demonstration!r}: label {label!r} is no state of task {task.name!r}; "
            f"states are {', '.join(s.name for s in task.states)}"
        )
    if not chosen and len(state.gestemes) == 1:
        chosen = state.gestemes[0]
    if chosen not in state.gestemes:
        raise LearningError(
            f"demonstration {demonstration!r}: label {label!r} does not name one of the gestemes "
            f"of state {state_name!r}; write "
            + " or ".join(f"{state_name}/{name}" for name in state.gestemes)
        )
    return names.index(chosen)


def _extent(positions: Array) -> float:
    return float(np.linalg.norm(np.ptp(positions, axis=0)))
