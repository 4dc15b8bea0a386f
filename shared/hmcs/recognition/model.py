"""A model: what a recognizer and the fixtures learned about a task."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.motion.orientation_profile import OrientationProfile
from hmcs.motion.paths import Path
from hmcs.task import AXES, Task


class Model(NamedTuple):
    """What was learned from demonstrations of a task. Frozen: learning again makes another."""

    name: str
    """What the model is called, in keys and in tables."""
    hash: str
    """Of the content: equal hashes mean equal models."""
    task: Task
    recognizer: str
    """The kind of recognizer it was learned for."""
    knowledge: Any
    """What that recognizer learned: a NamedTuple of its own."""
    path_points: tuple[NDArray[np.float64], ...]
    """For each gesteme its mean path from the segment's origin, m, shape (K, 3)."""
    path_spreads: tuple[NDArray[np.float64], ...]
    """For each gesteme the lateral RMS of the demonstrations about it, m, shape (K,)."""
    demonstrations: tuple[str, ...]
    """Names of the demonstrations it was learned from."""
    path_turns: tuple[NDArray[np.float64] | None, ...] = ()
    """For each gesteme how the hand turns along its path, x y z w since its beginning, shape
    (K, 4); None where demonstrations do not tell. Empty where none does."""

    @property
    def gesteme_names(self) -> tuple[str, ...]:
        """In the order of the task."""
        return tuple(gesteme.name for gesteme in self.task.gestemes)

    @property
    def state_names(self) -> tuple[str, ...]:
        """In the order of the task."""
        return tuple(state.name for state in self.task.states)

    @property
    def axes(self) -> tuple[int, ...]:
        """Indices of the axes the recognizer looks at."""
        return axes_of(self.task)

    @property
    def paths(self) -> dict[str, Path]:
        """The learned path of each gesteme, from the segment's origin, m."""
        return dict(zip(self.gesteme_names, map(Path, self.path_points), strict=True))

    @property
    def spreads(self) -> dict[str, NDArray[np.float64]]:
        """The spread along each path, m."""
        return dict(zip(self.gesteme_names, self.path_spreads, strict=True))

    @property
    def turns(self) -> dict[str, OrientationProfile]:
        """How the hand turns along the path of each gesteme that tells."""
        turns_by_gesteme = zip(self.gesteme_names, self.path_turns, strict=False)
        return {
            name: OrientationProfile(turns) for name, turns in turns_by_gesteme if turns is not None
        }


def axes_of(task: Task) -> tuple[int, ...]:
    """Return the indices of the axes that recognition of the task looks at."""
    return tuple(AXES[axis] for axis in task.recognition.axes)
