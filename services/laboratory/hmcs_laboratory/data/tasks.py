"""Tasks with labeled demonstrations to learn from, and steps to recognize."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import DeadZone, Step
from hmcs.recognition.scoring import NONE, midway_labels
from hmcs.task import Task

IntArray = NDArray[np.int64]


class Performance(NamedTuple):
    """A motion to be recognized."""

    steps: tuple[Step, ...]
    """Marked where the operator says that a segment begins."""
    states: IntArray
    """Index of the true task state of each step, shape (T,)."""

    def unmarked(self) -> Performance:
        """Return the same motion of an operator who says nothing."""
        return self._replace(steps=tuple(step._replace(mark=False) for step in self.steps))


class TaskSet(NamedTuple):
    """A task, and how it was performed."""

    task: Task
    demonstrations: tuple[Demonstration, ...]
    """To learn from."""
    performances: tuple[Performance, ...]
    """To recognize."""
    references: Mapping[str, Array]
    """The true curve of each gesteme, m, shape (K, 3); of human drawings none."""

    @property
    def gesteme_of_state(self) -> IntArray:
        """Index of each state's gesteme among the task's, shape (S,); a state has one here."""
        names = [gesteme.name for gesteme in self.task.gestemes]
        return np.array([names.index(state.gestemes[0]) for state in self.task.states])


def plain_task(
    name: str,
    states: Mapping[str, tuple[str, Mapping[str, float]]],
    start: Sequence[str],
    *,
    dead_zone_m: float,
    dimensions: int,
) -> Task:
    """Return a task in an empty workspace.

    `states` tells for each state its gesteme and which states follow with which probability.
    """
    gestemes = dict.fromkeys(gesteme for gesteme, _ in states.values())
    return Task.model_validate(
        {
            "format": "hmcs-task/1",
            "name": name,
            "dead_zone_m": dead_zone_m,
            "gestemes": [{"name": gesteme} for gesteme in gestemes],
            "states": [
                {"name": state, "gestemes": [gesteme], "next": dict(following)}
                for state, (gesteme, following) in states.items()
            ],
            "start": list(start),
            "recognition": {"axes": ["x", "y", "z"][:dimensions]},
            "workspace": {"lower_m": [-100.0] * 3, "upper_m": [100.0] * 3},
            "robot": {
                "model": "puma560",
                "tool_start_m": [0.0] * 3,
                "tool_orientation_xyzw": [0.0, 0.0, 0.0, 1.0],
            },
        }
    )


def sequential_task(
    name: str, gestemes: Sequence[str], *, dead_zone_m: float, dimensions: int
) -> Task:
    """Return a task whose states follow one another from left to right: S1 with the first gesteme.

    A gesteme that stands twice serves two states.
    """
    count = len(gestemes)
    states = {
        f"S{k}": (gesteme, {f"S{k + 1}": 1.0} if k < count else {})
        for k, gesteme in enumerate(gestemes, start=1)
    }
    return plain_task(name, states, ["S1"], dead_zone_m=dead_zone_m, dimensions=dimensions)


def path_of(steps: Sequence[Step]) -> Array:
    """Return where the hand was before each step and after the last, m, shape (T + 1, 3)."""
    ends = [step.position + step.displacement for step in steps]
    return np.array([steps[0].position, *ends])


def as_performance(demonstration: Demonstration, task: Task) -> Performance:
    """Return the steps of a labeled demonstration with the true state of each."""
    zone, steps, ends, here = DeadZone(task.dead_zone_m), [], [], 0
    switches = demonstration.switches
    for sample, position in enumerate(demonstration.positions):
        step = zone.push(position, pedal=bool(switches[sample]))
        if step is not None:
            steps.append(step)
            ends.append((here, sample))
            here = sample
    names = [state.name for state in task.states]
    labels = [
        NONE if label is None else names.index(label.partition("/")[0])
        for label in demonstration.states
    ]
    begin, end = np.array(ends).T
    return Performance(tuple(steps), midway_labels(labels, begin, end))
