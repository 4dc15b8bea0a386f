"""Demonstrations by reference: the path of a CSV file or a recording, or `lasa:SHAPE/NUMBER`.

Recordings are our own, or those of other programs, see `hmcs.recordings.foreign`.
"""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hmcs.motion.demonstrations import Demonstration, DemonstrationError
from hmcs.motion.lasa import read_drawing
from hmcs.recordings.csv_labels import read_labeled_csv
from hmcs.recordings.demonstrations import demonstrations_of, performances_of
from hmcs.recordings.file_rotation import SUFFIX as RECORDING
from hmcs.recordings.foreign.choices import AS_IT_IS, Choices
from hmcs.recordings.foreign.registry import format_of, take
from hmcs.recordings.labels import labels_of
from hmcs.recordings.reading import RecordingContent, RecordingError, read
from hmcs.task import Task

DRAWINGS = "lasa:"
"""What references to drawings begin with."""
_DRAWING = re.compile(r"lasa:(?P<shape>[^/]+)/(?P<first>\d{1,6})(?:-(?P<last>\d{1,6}))?")


class NoMotionError(RecordingError):
    """A recording without any motion of a hand; its message quotes nothing of the file."""


class Source(NamedTuple):
    """What a reference names."""

    reference: str
    demonstrations: tuple[Demonstration, ...]
    """One at least."""
    recording: RecordingContent | None
    """None where it is no recording of our own."""
    notes: tuple[str, ...] = ()
    """What should be known of it, a sentence each."""
    labels_beside: bool = True
    """Whether labels in a file beside it are read."""


def is_drawing(reference: str) -> bool:
    """Return whether a reference names drawings, and no file."""
    return _DRAWING.fullmatch(reference) is not None


def read_references(references: Sequence[str], task: Task) -> list[Demonstration]:
    """Return the demonstrations of a task that the references name; raises as `read_sources`."""
    return [
        demonstration
        for source in read_sources(references, task)
        for demonstration in source.demonstrations
    ]


def read_sources(
    references: Iterable[str],
    task: Task | None,
    *,
    labels_count: bool = True,
    choices: Choices = AS_IT_IS,
) -> list[Source]:
    """Return what each reference names; drawings need a task.

    `lasa:SHAPE/FIRST-LAST` names several drawings, a recording may hold several demonstrations:
    where labels count those that are labeled, else those its operator began anew. `choices` say
    how recordings of other programs and tables with other columns are read. Raises
    DemonstrationError for a reference that names none, RecordingError for a recording that cannot
    be used.
    """
    return told_apart([_read(reference, task, labels_count, choices) for reference in references])


def distinct(sources: Sequence[Source]) -> tuple[list[Source], list[str]]:
    """Return the sources without demonstrations that are there already, and what was left out.

    A demonstration is another one where its positions or its labels differ, whatever it is called:
    a file may be named twice, or copied.
    """
    kept, notes = list[Source](), list[str]()
    known = dict[bytes, str]()
    for source in sources:
        own = []
        for demonstration in source.demonstrations:
            content = _digest(demonstration)
            if content in known:
                notes.append(
                    f"{demonstration.name}: the same samples as {known[content]}: left out, since "
                    "it would count twice"
                )
            else:
                known[content] = demonstration.name
                own.append(demonstration)
        if own:
            kept.append(source._replace(demonstrations=tuple(own)))
    return kept, notes


def _digest(demonstration: Demonstration) -> bytes:
    digest = hashlib.sha256(repr(demonstration.states).encode())
    for array in (demonstration.positions, demonstration.orientations, demonstration.wrenches):
        digest.update(b"-" if array is None else np.ascontiguousarray(array).tobytes())
    return digest.digest()


def told_apart(sources: Sequence[Source]) -> list[Source]:
    """Name demonstrations of files with equal names by the whole reference, so that a message
    about one cannot be taken for another's."""
    bare = Counter(path.name for path in {Path(source.reference) for source in sources})
    return [
        source
        if bare[Path(source.reference).name] == 1 or source.reference.startswith(DRAWINGS)
        else source._replace(
            demonstrations=tuple(
                each._replace(
                    name=source.reference + each.name.removeprefix(Path(source.reference).name)
                )
                for each in source.demonstrations
            )
        )
        for source in sources
    ]


def _read(reference: str, task: Task | None, labels_count: bool, choices: Choices) -> Source:
    form = None if reference.startswith(DRAWINGS) else format_of(Path(reference))
    if form is not None:
        taken = take(form, Path(reference), choices)
        return Source(reference, taken.demonstrations, None, taken.notes, labels_beside=False)
    if reference.endswith(RECORDING):
        return _recorded(reference, labels_count)
    if not reference.startswith(DRAWINGS):
        labeled = read_labeled_csv(Path(reference), choices)
        return Source(reference, (labeled.demonstration,), None, labeled.notes)
    match = _DRAWING.fullmatch(reference)
    if match is None:
        raise DemonstrationError(
            f"{reference}: write lasa:SHAPE/NUMBER or lasa:SHAPE/FIRST-LAST, e.g. lasa:Sine/1-5"
        )
    if task is None:
        raise DemonstrationError(f"{reference}: a drawing is of a task: name it by --task")
    first = int(match["first"])
    last = int(match["last"] or first)
    if last < first:
        raise DemonstrationError(f"{reference}: the first number is larger than the last")
    drawings = (read_drawing(match["shape"], k, task) for k in range(first, last + 1))
    return Source(reference, tuple(drawings), None, labels_beside=False)


def _recorded(reference: str, labels_count: bool) -> Source:
    content = read(reference)
    found = demonstrations_of(content) if labels_count else performances_of(content)
    if not found:
        moved = labels_count and labels_of(content) and performances_of(content)
        raise NoMotionError(
            f"{reference}: its labels are where the hand did not move: label its motion"
            if moved
            else f"{reference}: there is no motion of a hand in it that held on: hold the dead-man "
            "switch, or the page's handle, while you record"
        )
    return Source(reference, tuple(found), content)
