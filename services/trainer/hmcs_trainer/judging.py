"""What a model will be worth: each demonstration recognized by a model of the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.learning import learn
from hmcs.recognition.registry import recognizer_of
from hmcs.recognition.scoring import NONE, Scores, pooled, score
from hmcs.recognition.segments import LearningError, labeled_steps
from hmcs.task import Task

MOST = 8
"""So many demonstrations are left out in turn, evenly chosen, where there are more."""


class Judgment(NamedTuple):
    """What was found."""

    left_out: int
    """Demonstrations that were recognized by a model of the others; those without which nothing
    can be learned are not."""
    scores: Scores
    confusion: NDArray[np.int64]
    """Steps of each true state (rows) believed to be each state, shape (S, S)."""


def judged(
    task: Task,
    demonstrations: Sequence[Demonstration],
    settings: Any,
    recognizer: str,
    progress: Callable[[int, int], None] = lambda _done, _all: None,
) -> Judgment:
    """Leave each demonstration out in turn; `progress` receives how many of all are done."""
    count, found = len(task.states), []
    chosen = np.unique(np.linspace(0, len(demonstrations) - 1, MOST).round().astype(int)).tolist()
    confusion = np.zeros((count, count), dtype=np.int64)
    for done, index in enumerate(chosen, start=1):
        left_out = demonstrations[index]
        others = [each for k, each in enumerate(demonstrations) if k != index]
        try:
            model = learn(task, others, settings, recognizer=recognizer)
        except LearningError:
            progress(done, len(chosen))
            continue
        labeled = labeled_steps(task, left_out)
        first = next((int(state) for state in labeled.states if state != NONE), 0)
        # A part of the task may be shown by itself.
        following = recognizer_of(model, anywhere=task.states[first].name not in task.start)
        believed = [int(np.argmax(following.step(step).belief.states)) for step in labeled.steps]
        found.append(score(labeled.states, np.array(believed, dtype=np.int64)))
        for true, likely in zip(labeled.states, believed, strict=True):
            if true != NONE:
                confusion[true, likely] += 1
        progress(done, len(chosen))
    empty = np.zeros(0, dtype=np.int64)
    return Judgment(len(found), pooled(found) if found else score(empty, empty), confusion)
