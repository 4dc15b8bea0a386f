"""What is wrong with demonstrations before anything is learned from them, and what to do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.disagreement import check_agreement
from hmcs.recognition.segments import LearningError, Segment, segments_of
from hmcs.task import Task

LEAST_S = 0.5
"""A stretch shorter than this in time is a slip of the pedal."""
UNLABELED_M = 0.05
"""So much motion between two labels is no pause."""
FEW = 2
"""A state shown no more often leaves its spread to chance."""
OUTLIER = 4.0
"""Lengths differ by so many times the median difference from the median length, and..."""
OUTLIER_SHARE = 0.5
"""...by this share of it, at least, to be wild."""


class Finding(NamedTuple):
    """Something to tell whoever gave the demonstrations."""

    serious: bool
    """Whether nothing can be learned because of it."""
    text: str
    """What, where and when, and what to do."""


def findings(task: Task, demonstrations: Sequence[Demonstration]) -> list[Finding]:
    """Return what is wrong, the serious first; none where all is well."""
    found = [
        finding
        for demonstration in demonstrations
        for finding in (*_unlabeled(demonstration), *_hasty(demonstration))
    ]
    try:
        segments = segments_of(task, demonstrations)
        check_agreement(task, segments)
    except LearningError as error:
        return [Finding(True, str(error)), *found]
    found += _missing(task, segments)
    found += _rare(task, segments)
    found += _wild(task, segments)
    return sorted(found, key=lambda finding: not finding.serious)


def _unlabeled(demonstration: Demonstration) -> list[Finding]:
    found = []
    for label, samples in demonstration.stretches:
        if label is not None:
            continue
        moved = np.diff(demonstration.positions[samples], axis=0)
        moved_m = float(np.linalg.norm(moved, axis=1).sum())
        begun, ended = samples.start > 0, samples.stop < len(demonstration.positions)
        if moved_m > UNLABELED_M and begun and ended:
            found.append(
                Finding(
                    False,
                    f"{demonstration.name}: from {_when(demonstration, samples)} the hand moves "
                    f"{moved_m:.2f} m without a label: it is left out; label it, if it is part of "
                    "the task",
                )
            )
    return found


def _hasty(demonstration: Demonstration) -> list[Finding]:
    return [
        Finding(
            False,
            f"{demonstration.name}: {label!r} from {_when(demonstration, samples)} lasts "
            f"less than {LEAST_S:g} s: was the pedal pressed twice? Join it to its neighbor",
        )
        for label, samples in demonstration.stretches
        if label is not None and _lasts_s(demonstration, samples) < LEAST_S
    ]


def _missing(task: Task, segments: Sequence[Segment]) -> list[Finding]:
    shown = {segment.gesteme for segment in segments}
    return [
        Finding(
            True,
            f"gesteme {gesteme.name!r} has no demonstration: add one with a state it is performed "
            "in",
        )
        for index, gesteme in enumerate(task.gestemes)
        if index not in shown
    ]


def _rare(task: Task, segments: Sequence[Segment]) -> list[Finding]:
    found = []
    shown = {segment.gesteme for segment in segments}
    names = [gesteme.name for gesteme in task.gestemes]
    for index, state in enumerate(task.states):
        times = sum(segment.state == index for segment in segments)
        if 0 < times < FEW:
            found.append(
                Finding(
                    False,
                    f"state {state.name!r} is shown once: how much it may vary is a guess; show it "
                    "again",
                )
            )
        elif not times and any(names.index(name) in shown for name in state.gestemes):
            found.append(
                Finding(
                    False,
                    f"state {state.name!r} is never shown, only its gestemes are: how long it "
                    "lasts is unknown; show it",
                )
            )
    return found


def _wild(task: Task, segments: Sequence[Segment]) -> list[Finding]:
    """Performances far longer or shorter than the others of their gesteme."""
    found = []
    for index, gesteme in enumerate(task.gestemes):
        own = [segment for segment in segments if segment.gesteme == index]
        if len(own) <= FEW:
            continue
        lengths = np.array([len(segment.steps) for segment in own]) * task.dead_zone_m
        usual = float(np.median(lengths))
        off = np.abs(lengths - usual)
        limit = max(OUTLIER * float(np.median(off)), OUTLIER_SHARE * usual)
        for segment, length, apart in zip(own, lengths, off, strict=True):
            if apart > limit:
                state = task.states[segment.state].name
                found.append(
                    Finding(
                        False,
                        f"{segment.demonstration}: {state!r} is {length:.2f} m long, the others of "
                        f"gesteme {gesteme.name!r} about {usual:.2f} m: leave it out, if it was "
                        "not meant, or show more like it",
                    )
                )
    return found


def _lasts_s(demonstration: Demonstration, samples: slice) -> float:
    last = min(samples.stop, len(demonstration.time_s)) - 1
    return float(demonstration.time_s[last] - demonstration.time_s[samples.start])


def _when(demonstration: Demonstration, samples: slice) -> str:
    last = min(samples.stop, len(demonstration.time_s)) - 1
    begin_s, end_s = (demonstration.time_s[at] for at in (samples.start, last))
    return f"{begin_s:.1f} s to {end_s:.1f} s"
