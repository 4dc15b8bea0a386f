"""What is wrong with demonstrations before anything is learned from them, and what to do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.disagreement import check_agreement, turn_agreement
from hmcs.recognition.segment_filter.gestemes import LONGEST_WINDOW_STEPS
from hmcs.recognition.segments import LearningError, Segment, check_arrays, segments_of
from hmcs.task import Task
from hmcs_trainer.plausibility import Finding, implausible, length_of

__all__ = ["Finding", "findings"]

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
OUTLIER_OF_TWO = 2.0
"""Of two performances, one so many times as long as the other is wild."""
OTHER_UNITS = 10.0
"""So many times as long, or as short, is no way of showing the same: its units are others."""
FLAT_STEPS = 3.0
"""So many dead zones along z are no plane."""
SLOWER = 1.25
"""A hand may make so many times the steps that were demonstrated."""


def findings(task: Task, demonstrations: Sequence[Demonstration]) -> list[Finding]:
    """Return what is wrong, the serious first; none where all is well."""
    found = list[Finding]()
    try:
        for demonstration in demonstrations:
            check_arrays(demonstration)
            found += implausible(task, demonstration)
            found += _unlabeled(demonstration)
            found += _hasty(task, demonstration)
        segments = segments_of(task, demonstrations)
        found += _missing(task, segments)
        found += _rare(task, segments)
        found += _wild(task, segments)
        found += _long(task, segments)
        found += _unturned(task, segments)
        found += _flat(task, segments)
        if not any(finding.serious for finding in found):
            # Where hands jump, or units differ, disagreement is a consequence.
            check_agreement(task, segments)
    except LearningError as error:
        found.append(Finding(True, str(error), unquoted=error.unquoted))
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


def _hasty(task: Task, demonstration: Demonstration) -> list[Finding]:
    states = {state.name for state in task.states}
    return [
        Finding(
            False,
            f"{demonstration.name}: {label!r} from {_when(demonstration, samples)} lasts "
            f"less than {LEAST_S:g} s: was the pedal pressed twice? Join it to its neighbor",
        )
        for label, samples in demonstration.stretches
        if label is not None
        and label.partition("/")[0] in states
        and _lasts_s(demonstration, samples) < LEAST_S
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
        lengths = np.array([length_of(segment.steps) for segment in own])
        for k, segment in enumerate(own if len(own) > 1 else ()):
            others = np.delete(lengths, k)
            usual = float(np.median(lengths if len(own) > FEW else others))
            if not _is_wild(float(lengths[k]), lengths, usual):
                continue
            ratio = max(float(lengths[k]) / usual, usual / float(lengths[k]))
            remedy = (
                "are its units, or those of the others, the right ones? Mend it, or leave it out"
                if ratio > OTHER_UNITS
                else "leave it out, if it was not meant, or show more like it"
            )
            found.append(
                Finding(
                    ratio > OTHER_UNITS,
                    f"{segment.demonstration}: {task.states[segment.state].name!r} is "
                    f"{lengths[k]:.2f} m long, the others of gesteme {gesteme.name!r} about "
                    f"{usual:.2f} m: {remedy}",
                    may_be_accepted=True,
                )
            )
    return found


def _is_wild(length: float, lengths: Array, usual: float) -> bool:
    if len(lengths) <= FEW:
        return not 1.0 / OUTLIER_OF_TWO < length / usual < OUTLIER_OF_TWO
    off = np.abs(lengths - usual)
    return abs(length - usual) > max(OUTLIER * float(np.median(off)), OUTLIER_SHARE * usual)


def _long(task: Task, segments: Sequence[Segment]) -> list[Finding]:
    """Gestemes so long that their beginning is forgotten before they end."""
    found = []
    for index, gesteme in enumerate(task.gestemes):
        own = [segment for segment in segments if segment.gesteme == index]
        longest = max(own, key=lambda segment: len(segment.steps), default=None)
        if longest is None or len(longest.steps) * SLOWER <= LONGEST_WINDOW_STEPS:
            continue
        steps = len(longest.steps)
        wanted_m = SLOWER * length_of(longest.steps) / LONGEST_WINDOW_STEPS
        found.append(
            Finding(
                False,
                f"{longest.demonstration}: gesteme {gesteme.name!r} takes {steps} steps of "
                f"dead_zone_m ({task.dead_zone_m:g}), and {LONGEST_WINDOW_STEPS} are remembered: "
                "it is not recognized to its end when performed a little longer; make dead_zone_m "
                f"{_up(wanted_m):g} or more, or make two gestemes of it",
            )
        )
    return found


def _unturned(task: Task, segments: Sequence[Segment]) -> list[Finding]:
    """Performances whose turns are not learned."""
    found = []
    for index, gesteme in enumerate(task.gestemes):
        own = [segment for segment in segments if segment.gesteme == index]
        untold = [segment.demonstration for segment in own if segment.orientations is None]
        if untold and len(untold) < len(own):
            found.append(
                Finding(
                    False,
                    f"{untold[0]}: it has no orientations, others of gesteme {gesteme.name!r} "
                    "have: how the hand turns is not learned; record them in all, or in none",
                )
            )
        elif len(own) > 1 and not untold:
            alike, apart_rad = turn_agreement(own)
            found += [
                Finding(
                    False,
                    f"{segment.demonstration}: in {task.states[segment.state].name!r} the hand "
                    f"turns up to {np.degrees(apart_rad[k]):.0f}° otherwise than in "
                    f"{own[alike[0]].demonstration}: its turns are left out of what is learned; "
                    "turn the same way round in all, or give them gestemes of their own",
                )
                for k, segment in enumerate(own)
                if k not in alike
            ]
    return found


def _flat(task: Task, segments: Sequence[Segment]) -> list[Finding]:
    """Performances in the plane z = 0 where others of their gesteme are in space."""
    found = []
    for index, gesteme in enumerate(task.gestemes):
        own = [segment for segment in segments if segment.gesteme == index]
        flat = [segment for segment in own if not segment.positions[:, 2].any()]
        others = [segment for segment in own if segment.positions[:, 2].any()]
        if not flat or not others:
            continue
        high_m = float(np.median([np.ptp(segment.positions[:, 2]) for segment in others]))
        if high_m > FLAT_STEPS * task.dead_zone_m:
            names = ", ".join(dict.fromkeys(segment.demonstration for segment in flat))
            found.append(
                Finding(
                    True,
                    f"{names}: {gesteme.name!r} stays in the plane z = 0, others of it move "
                    f"{high_m:.2f} m along z: is the column z_m missing? Give all of them in two "
                    "dimensions, or in three",
                    may_be_accepted=True,
                )
            )
    return found


def _up(length_m: float) -> float:
    """Rounded up to two digits."""
    digit = 10.0 ** (np.floor(np.log10(length_m)) - 1)
    return float(np.ceil(length_m / digit) * digit)


def _lasts_s(demonstration: Demonstration, samples: slice) -> float:
    last = min(samples.stop, len(demonstration.time_s)) - 1
    return float(demonstration.time_s[last] - demonstration.time_s[samples.start])


def _when(demonstration: Demonstration, samples: slice) -> str:
    last = min(samples.stop, len(demonstration.time_s)) - 1
    begin_s, end_s = (demonstration.time_s[at] for at in (samples.start, last))
    return f"{begin_s:.1f} s to {end_s:.1f} s"
