"""What demonstrations are like, each for itself and all together, and what to do about them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Literal, NamedTuple

import numpy as np

from hmcs.errors import UserError
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import steps_of
from hmcs.recognition.segments import segments_of
from hmcs.recordings.foreign.choices import AS_IT_IS, Choices
from hmcs.task import Task
from hmcs_trainer.plausibility import (
    Finding,
    implausible,
    length_of,
    likely_units,
    limits_of,
    seems_other_times,
)
from hmcs_trainer.recorded import recording_findings
from hmcs_trainer.references import Source, distinct, read_sources, told_apart
from hmcs_trainer.validation import findings

Verdict = Literal["yes", "mind", "no"]
"""Whether a demonstration can be trained from: as it is, with what is said of it, or not."""
_SHORT = {"millimeters": "mm", "centimeters": "cm", "inches": "in"}


class Judged(NamedTuple):
    """What a demonstration is like."""

    name: str
    units: str
    """Of its positions and times, with a question mark where they seem to be others."""
    samples: int
    rate_hz: float
    """By the median of its sampling periods."""
    lasts_s: float
    way_m: float
    """The length of its way."""
    lower_m: tuple[float, float, float]
    """Corner of the box its way fits in."""
    upper_m: tuple[float, float, float]
    fits: bool | None
    """Whether its way fits the task's workspace; None without a task."""
    states: tuple[str, ...]
    """Its labels, in the order they first come; none where it has no labels."""
    verdict: Verdict


class Check(NamedTuple):
    """What there is to say of all files."""

    judged: tuple[Judged, ...]
    findings: tuple[Finding, ...]
    """What may be wrong, and what to do, the serious first."""


def check_files(references: Iterable[str], task: Task | None, choices: Choices = AS_IT_IS) -> Check:
    """Judge what each reference names; what cannot be read is one serious finding.

    Where a task is given, labels are judged by it, and what is labeled as what is trained from
    together.
    """
    sources, found = list[Source](), list[Finding]()
    for reference in references:
        try:
            sources += read_sources([reference], task, choices=choices)
        except UserError as error:
            found.append(Finding(True, str(error)))
    sources = told_apart(sources)
    kept, doubled = distinct(sources)
    found += [Finding(False, note) for note in doubled]
    for source in sources:
        found += [Finding(False, note) for note in source.notes]
        if source.recording is not None:
            found += recording_findings(task, source.recording)
    shown = [each for source in kept for each in source.demonstrations]
    labeled = [each for each in shown if any(state is not None for state in each.states)]
    if task is None or not labeled:
        found += [finding for each in shown for finding in implausible(task, each)]
    else:
        bare = [each for each in shown if all(state is None for state in each.states)]
        found += [finding for each in bare for finding in implausible(task, each)]
        found += findings(task, labeled)
    found += _unlabeled(shown)
    found += _planes(shown)
    unique = tuple(dict.fromkeys(found))
    return Check(
        tuple(_judged(task, each) for source in sources for each in source.demonstrations),
        tuple(sorted(unique, key=lambda finding: not finding.serious)),
    )


def _judged(task: Task | None, shown: Demonstration) -> Judged:
    limits = limits_of(task)
    own = implausible(task, shown)
    states = tuple(dict.fromkeys(state for state in shown.states if state is not None))
    serious = any(finding.serious for finding in own) or not _can_be_cut(task, shown, states)
    lower, upper = (tuple(f(shown.positions, axis=0).tolist()) for f in (np.min, np.max))
    fits = None
    if task is not None:
        fits = not any("workspace" in finding.text for finding in own)
    times = "s or not?" if seems_other_times(limits, shown) else "s"
    units = likely_units(limits, shown)
    length = " or ".join(_SHORT[unit] for unit in units) + "?" if units else "m"
    return Judged(
        shown.name,
        f"{length}, {times}",
        len(shown.positions),
        1.0 / float(np.median(np.diff(shown.time_s))),
        float(shown.time_s[-1] - shown.time_s[0]),
        length_of(steps_of(shown.positions, limits.dead_zone_m)),
        lower,
        upper,
        fits,
        states,
        "no" if serious else "mind" if own or not states else "yes",
    )


def _can_be_cut(task: Task | None, shown: Demonstration, states: Sequence[str]) -> bool:
    """Whether its labels are those of the task; so they are where it has none."""
    if task is None or not states:
        return True
    try:
        segments_of(task, [shown])
    except UserError:
        return False
    return True


def _unlabeled(shown: Sequence[Demonstration]) -> Iterator[Finding]:
    for each in shown:
        if all(state is None for state in each.states):
            yield Finding(
                False,
                f"{each.name}: has no labels: add a column 'state', label a recording with `hmcs "
                "label` or on the page, or train with --find-states",
            )


def _planes(shown: Sequence[Demonstration]) -> Iterator[Finding]:
    """Motion in the plane z = 0 beside motion in space."""
    flat = [not each.positions[:, 2].any() for each in shown]
    if any(flat) and not all(flat):
        names = [each.name for each, is_flat in zip(shown, flat, strict=True) if is_flat]
        yield Finding(
            False,
            f"{', '.join(names[:3])}{' and others' if len(names) > 3 else ''}: in the plane z = 0, "
            f"the others in space: is the column z_m missing? Give all of them in two dimensions "
            "or in three",
        )
