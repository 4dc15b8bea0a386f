"""Demonstrations by reference: the path of a CSV file or a recording, or `lasa:SHAPE/NUMBER`."""

from __future__ import annotations

import re

from hmcs.motion.demonstrations import Demonstration, DemonstrationError, read_csv
from hmcs.motion.lasa import read_drawing
from hmcs.recordings.demonstrations import demonstrations_of
from hmcs.recordings.parts import SUFFIX as RECORDING
from hmcs.recordings.reading import read
from hmcs.task import Task

_DRAWING = re.compile(r"lasa:(?P<shape>[^/]+)/(?P<first>\d+)(?:-(?P<last>\d+))?")


def read_references(references: list[str], task: Task) -> list[Demonstration]:
    """Return the demonstrations of a task that the references name.

    `lasa:SHAPE/FIRST-LAST` names several drawings, a recording may hold several. Raises
    DemonstrationError for a reference that names none, RecordingError for a recording that cannot
    be used.
    """
    return [demonstration for item in references for demonstration in _read(item, task)]


def _read(reference: str, task: Task) -> list[Demonstration]:
    if reference.endswith(RECORDING):
        return demonstrations_of(read(reference))
    if not reference.startswith("lasa:"):
        return [read_csv(reference)]
    match = _DRAWING.fullmatch(reference)
    if match is None:
        raise DemonstrationError(
            f"{reference}: write lasa:SHAPE/NUMBER or lasa:SHAPE/FIRST-LAST, e.g. lasa:Sine/1-5"
        )
    first = int(match["first"])
    last = int(match["last"] or first)
    if last < first:
        raise DemonstrationError(f"{reference}: the first number is larger than the last")
    return [read_drawing(match["shape"], number, task) for number in range(first, last + 1)]
