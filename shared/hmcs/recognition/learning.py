"""Learning a model of a task from labeled demonstrations, for any registered recognizer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.orientation_profile import mean_orientation_profile
from hmcs.motion.paths import mean_path
from hmcs.recognition.disagreement import turn_agreement
from hmcs.recognition.model import Model
from hmcs.recognition.registry import DEFAULT, TrainingData, kind_named
from hmcs.recognition.segments import LearningError, Segment, segments_of
from hmcs.task import Task


def learn(
    task: Task,
    demonstrations: Sequence[Demonstration],
    settings: Any = None,
    *,
    recognizer: str = DEFAULT,
    rng: np.random.Generator | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Model:
    """Return the model of the task learned from labeled demonstrations; `hash` is left empty.

    `settings` are the recognizer's own, its defaults where None. Without `rng` what is random is
    drawn from a generator of seed 0, so that learning twice gives the same model.

    Raises LearningError when there are no demonstrations, one has samples that are none or not a
    label each, a label is no state of the task, a gesteme has no demonstration, or a segment is too
    short to hold two steps; UserError for an unknown recognizer.
    """
    kind = kind_named(recognizer)
    segments = segments_of(task, demonstrations)
    by_gesteme = [[s for s in segments if s.gesteme == g] for g in range(len(task.gestemes))]
    for gesteme, own in zip(task.gestemes, by_gesteme, strict=True):
        if not own:
            raise LearningError(
                f"gesteme {gesteme.name!r} of task {task.name!r} has no demonstration: "
                "add one with its label"
            )
        plural = "" if len(own) == 1 else "s"
        progress(f"{gesteme.name}: {len(own)} demonstration{plural}")
    data = TrainingData(
        task,
        tuple(demonstrations),
        tuple(segments),
        kind.settings() if settings is None else settings,
        np.random.default_rng(0) if rng is None else rng,
        progress,
    )
    knowledge = kind.learn(data)
    turns = tuple(map(_turns, by_gesteme))
    paths = [mean_path([segment.positions for segment in own]) for own in by_gesteme]
    return Model(
        name=task.name,
        hash="",
        task=task,
        recognizer=kind.name,
        knowledge=knowledge,
        path_points=tuple(points for points, _ in paths),
        path_spreads=tuple(spread for _, spread in paths),
        demonstrations=tuple(d.name for d in demonstrations),
        path_turns=turns if any(turn is not None for turn in turns) else (),
    )


def _turns(segments: Sequence[Segment]) -> Array | None:
    """How the hand turns along a gesteme's path, (K, 4); None unless every performance tells.

    The mean of those that turn it alike: of two ways round the one that more performances take.
    """
    if any(segment.orientations is None for segment in segments):
        return None
    alike = [segments[k] for k in turn_agreement(segments).alike]
    orientations = [s.orientations for s in alike if s.orientations is not None]
    return mean_orientation_profile([segment.positions for segment in alike], orientations)
