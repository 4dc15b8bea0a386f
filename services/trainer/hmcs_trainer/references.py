"""Demonstrations by reference: the path of a CSV file or a recording, or `lasa:SHAPE/NUMBER`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from hmcs.motion.demonstrations import Demonstration, DemonstrationError, read_csv
from hmcs.motion.lasa import read_drawing
from hmcs.recordings.demonstrations import demonstrations_of, performances_of
from hmcs.recordings.labels import labels_of
from hmcs.recordings.parts import SUFFIX as RECORDING
from hmcs.recordings.reading import RecordingContent, RecordingError, read
from hmcs.task import Task

_DRAWING = re.compile(r"lasa:(?P<shape>[^/]+)/(?P<first>\d+)(?:-(?P<last>\d+))?")


class Source(NamedTuple):
    """What a reference names."""

    reference: str
    demonstrations: tuple[Demonstration, ...]
    """One at least."""
    recording: RecordingContent | None
    """None where it is no recording."""


def read_references(references: Sequence[str], task: Task) -> list[Demonstration]:
    """Return the demonstrations of a task that the references name; raises as `read_sources`."""
    return [
        demonstration
        for source in read_sources(references, task)
        for demonstration in source.demonstrations
    ]


def read_sources(
    references: Sequence[str], task: Task, *, labels_count: bool = True
) -> list[Source]:
    """Return what each reference names.

    `lasa:SHAPE/FIRST-LAST` names several drawings, a recording may hold several demonstrations:
    where labels count those that are labeled, else those its operator began anew. Raises
    DemonstrationError for a reference that names none, RecordingError for a recording that cannot
    be used.
    """
    return [_read(reference, task, labels_count) for reference in references]


def _read(reference: str, task: Task, labels_count: bool) -> Source:
    if reference.endswith(RECORDING):
        return _recorded(reference, labels_count)
    if not reference.startswith("lasa:"):
        return Source(reference, (read_csv(reference),), None)
    match = _DRAWING.fullmatch(reference)
    if match is None:
        raise DemonstrationError(
            f"{reference}: write lasa:SHAPE/NUMBER or lasa:SHAPE/FIRST-LAST, e.g. lasa:Sine/1-5"
        )
    first = int(match["first"])
    last = int(match["last"] or first)
    if last < first:
        raise DemonstrationError(f"{reference}: the first number is larger than the last")
    drawings = (read_drawing(match["shape"], k, task) for k in range(first, last + 1))
    return Source(reference, tuple(drawings), None)


def _recorded(reference: str, labels_count: bool) -> Source:
    content = read(reference)
    found = demonstrations_of(content) if labels_count else performances_of(content)
    if not found:
        moved = labels_count and labels_of(content) and performances_of(content)
        raise RecordingError(
            f"{reference}: its labels are where the hand did not move: label its motion"
            if moved
            else f"{reference}: there is no motion of a hand in it that held on: hold the dead-man "
            "switch, or the page's handle, while you record"
        )
    return Source(reference, tuple(found), content)
