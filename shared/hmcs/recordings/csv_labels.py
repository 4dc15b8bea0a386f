"""Labels beside a demonstration in a CSV file, as recordings have them: NAME.labels.csv.

They count instead of the column `state`; their seconds are those of the column `time_s`. A line of
that file has the fingerprint of the demonstration: beside another one of the same name the labels
do not count. A file without it is taken as it is.
"""

from __future__ import annotations

import hashlib
from bisect import bisect_right
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from hmcs.motion.demonstrations import Demonstration, DemonstrationError, read_with_others
from hmcs.recordings.fingerprints import Fingerprint
from hmcs.recordings.foreign.choices import AS_IT_IS, Choices
from hmcs.recordings.foreign.mapped_csv import Mapped
from hmcs.recordings.generated_marker import with_generated_marker
from hmcs.recordings.label_files import labels_text, read_labels
from hmcs.recordings.labels import SUFFIX, labels_beside
from hmcs.recordings.stretches import Stretch, ends_after, misread_unit, stretch_text, to_ns
from hmcs.whole_files import written_whole

_BYTES = 1 << 20


class LabeledCsv(NamedTuple):
    """A demonstration with the labels that count."""

    demonstration: Demonstration
    notes: tuple[str, ...]
    """What should be known of its columns and of the labels beside it, a sentence each."""


def read_labeled_csv(file: Path, choices: Choices = AS_IT_IS) -> LabeledCsv:
    """Read a demonstration and the labels beside it.

    Columns of other names and units are read as `choices` or the header says. Raises
    DemonstrationError as `read_csv` does and for a file of labels in its place, RecordingError as
    `read_labels` does, and LabelError for labels that cannot be of it.
    """
    if file.name.endswith(SUFFIX):
        raise DemonstrationError(
            f"{file}: is a file of labels: name the demonstration beside it, whose labels they are"
        )
    mapped, beside = Mapped(file, choices), labels_beside(file)
    demonstration, ignored = read_with_others(file, mapped)
    notes = list(mapped.notes)
    notes += [f"{file.name}: not read: column {', '.join(map(repr, ignored))}"] if ignored else []
    if not beside.is_file():
        return LabeledCsv(demonstration, tuple(notes))
    written = read_labels(beside, 0)
    if written.fingerprint not in (None, csv_fingerprint(file)):
        note = (
            f"the labels in {beside.name} are of another demonstration that had this name: they do "
            "not count; remove that file, or, if they are of this one, its line with the "
            "fingerprint"
        )
        return LabeledCsv(demonstration, (*notes, f"{file.name}: {note}"))
    _check_times(demonstration, beside, written.stretches, written.lines)
    return LabeledCsv(labeled_by(demonstration, written.stretches), tuple(notes))


def labeled_by(demonstration: Demonstration, stretches: Sequence[Stretch]) -> Demonstration:
    """Return a demonstration whose labels are those of stretches in ns of its own time."""
    begins = [stretch.begin_ns for stretch in stretches]

    def state_at(ns: int) -> str | None:
        index = bisect_right(begins, ns) - 1
        return stretches[index].state if index >= 0 and ns < stretches[index].end_ns else None

    states = tuple(state_at(to_ns(at_s)) for at_s in demonstration.time_s.tolist())
    return demonstration._replace(states=states)


def write_csv_labels(
    target: Path, stretches: Sequence[Stretch], demonstration: Path, *, found: bool = False
) -> None:
    """Write labels of the demonstration in a CSV file as they are read, whole or not at all.

    Those that were `found` carry a remark that says so. Raises DemonstrationError where a file
    cannot be read or written.
    """
    text = labels_text(stretches, 0, csv_fingerprint(demonstration))
    try:
        with written_whole(target) as unfinished:
            unfinished.write_text(
                with_generated_marker(text) if found else text, encoding="utf-8", newline="\n"
            )
    except OSError as error:
        raise DemonstrationError(f"{target}: cannot be written: {error.strerror}") from error


def csv_fingerprint(file: Path) -> Fingerprint:
    """Return the fingerprint of all of a CSV file; DemonstrationError where it cannot be read."""
    digest = hashlib.blake2b(digest_size=8)
    try:
        with file.open("rb") as stream:
            while part := stream.read(_BYTES):
                digest.update(part)
    except OSError as error:
        raise DemonstrationError(f"{file}: cannot be read: {error.strerror}") from error
    return Fingerprint(1, digest.hexdigest())


def _check_times(
    shown: Demonstration, file: Path, stretches: Sequence[Stretch], lines: Sequence[int]
) -> None:
    first_ns, last_ns = to_ns(float(shown.time_s[0])), to_ns(float(shown.time_s[-1]))
    lasts = f"from {shown.time_s[0]:.3f} s to {shown.time_s[-1]:.3f} s"
    unit = misread_unit(stretches, 0, last_ns)
    if unit and last_ns > first_ns:
        raise DemonstrationError(
            f"{file}: the demonstration is {lasts}, and the times of these labels read like {unit}"
        )
    for stretch, line in zip(stretches, lines, strict=True):
        if stretch.begin_ns >= last_ns or ends_after(stretch, last_ns + to_ns(1.0)):
            raise DemonstrationError(
                f"{file}:{line}: label {stretch_text(stretch)} is outside of the demonstration, "
                f"which is {lasts}: label what is in it"
            )
