"""A model: everything a recognizer and its fixtures learned about a task."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.motion.paths import Path
from hmcs.recognition.gestemes import GestemeBank, GestemeParameters, Scoring
from hmcs.recognition.segment_filter import FilterSettings, SegmentFilter, TaskChain
from hmcs.recognition.unknown import AlarmSettings
from hmcs.task import Task

AXES = {"x": 0, "y": 1, "z": 2}


class Model(NamedTuple):
    """What was learned from demonstrations of a task. Frozen: learning again makes another."""

    name: str
    """What the recognizer is called, in keys and in tables."""
    hash: str
    """Of the content: equal hashes mean equal models."""
    task: Task
    parameters: GestemeParameters
    """Of the gestemes in the order of `task.gestemes`."""
    scoring: Scoring
    filter_settings: FilterSettings
    alarm: AlarmSettings
    path_points: tuple[NDArray[np.float64], ...]
    """For each gesteme its mean path from the segment's origin, m, shape (K, 3)."""
    path_spreads: tuple[NDArray[np.float64], ...]
    """For each gesteme the lateral RMS of the demonstrations about it, m, shape (K,)."""
    demonstrations: tuple[str, ...]
    """Names of the demonstrations it was learned from."""

    @property
    def gesteme_names(self) -> tuple[str, ...]:
        """In the order of the parameters."""
        return tuple(gesteme.name for gesteme in self.task.gestemes)

    @property
    def state_names(self) -> tuple[str, ...]:
        """In the order of the filter's states."""
        return tuple(state.name for state in self.task.states)

    @property
    def axes(self) -> tuple[int, ...]:
        """Indices of the axes the recognizer looks at."""
        return tuple(AXES[axis] for axis in self.task.recognition.axes)

    @property
    def paths(self) -> dict[str, Path]:
        """The learned path of each gesteme, from the segment's origin, m."""
        return dict(zip(self.gesteme_names, map(Path, self.path_points), strict=True))

    @property
    def spreads(self) -> dict[str, NDArray[np.float64]]:
        """The spread along each path, m."""
        return dict(zip(self.gesteme_names, self.path_spreads, strict=True))

    def bank(self, held: Sequence[int] | None = None) -> GestemeBank:
        """Return a fresh bank of the gestemes with the indices `held`, or of all."""
        indices = range(len(self.task.gestemes)) if held is None else held
        return GestemeBank(self.parameters, self.scoring, self.axes, indices)

    def filter(self, *, anywhere: bool = False) -> SegmentFilter:
        """Return a fresh filter for the task; with `anywhere` every state may be the first."""
        return SegmentFilter(chain_of(self.task, anywhere=anywhere), self.filter_settings)


def chain_of(task: Task, *, anywhere: bool = False) -> TaskChain:
    """Return the task's states as the filter wants them; gestemes of a state are equally likely.

    With `anywhere` every state may be the first.
    """
    states = [state.name for state in task.states]
    gestemes = [gesteme.name for gesteme in task.gestemes]
    slots = [
        (q, gestemes.index(name), 1.0 / len(state.gestemes))
        for q, state in enumerate(task.states)
        for name in state.gestemes
    ]
    uniform = np.full(len(states), 1.0 / len(states))
    return TaskChain(
        initial=uniform if anywhere else np.array([task.start.get(name, 0.0) for name in states]),
        transition=np.array(
            [[state.next.get(name, 0.0) for name in states] for state in task.states]
        ),
        slot_state=np.array([slot[0] for slot in slots], dtype=np.int32),
        slot_gesteme=np.array([slot[1] for slot in slots], dtype=np.int32),
        slot_share=np.array([slot[2] for slot in slots]),
    )
