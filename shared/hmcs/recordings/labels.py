"""Which part of the task each moment of a recording was: said meanwhile, or written beside it.

Labels said while the hand moved are `Label` messages. Labels set afterwards stand in a CSV file
beside the recording, `NAME.labels.csv` with the header `begin_s,end_s,state`, in seconds since the
recording's first message; they count instead of those said. The recording is never changed. A line
of that file that begins with # is a remark. One of them has the recording's fingerprint: beside
another recording of the same name the labels do not count. A file without it is taken as it is.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Literal, NamedTuple

from hmcs.bus.messages import Label, Step
from hmcs.plain_numbers import number_in, separator_in
from hmcs.recordings.fingerprints import Fingerprint, fingerprint_in, fingerprint_of, is_of
from hmcs.recordings.found import COMMENT, is_as_found, marked
from hmcs.recordings.reading import RecordingContent, RecordingError
from hmcs.recordings.stretches import (
    NS_PER_S,
    Stretch,
    ends_after,
    misread_unit,
    to_ns,
    told,
)
from hmcs.whole_files import written_whole

HEADER = ["begin_s", "end_s", "state"]
SUFFIX = ".labels.csv"
How = Literal["said meanwhile", "set afterwards", "found"]
LARGEST_BYTES = 8 * 1024 * 1024
"""Of a file of labels; of a hundred thousand it has less."""
MOST_LABELS = 100_000
"""Of a recording: one for every third of a second of ten hours."""
FAR_BEYOND_S = 1.0
"""Who wrote a label that ends later than the recording by more than this meant something else than
a rounded number."""
MOST_SECONDS = 1e19
"""What is larger is no time, not even in nanoseconds since 1970."""
_SHOWN = 80


class _Written(NamedTuple):
    """A file of labels."""

    stretches: tuple[Stretch, ...]
    lines: tuple[int, ...]
    """Of each stretch in the file."""
    fingerprint: Fingerprint | None


def labels_beside(recording: Path) -> Path:
    """Return where labels of a recording are written that are set afterwards."""
    return recording.with_name(f"{recording.stem}{SUFFIX}")


def how_labeled(content: RecordingContent) -> How:
    """Return how the labels of a recording were set, those that count; raises as `labels_of`."""
    beside = _written_beside(content)
    if beside is None or _is_of_another(content, beside):
        return "said meanwhile"
    return "found" if is_as_found(labels_beside(content.path)) else "set afterwards"


def labels_of(content: RecordingContent) -> tuple[Stretch, ...]:
    """Return the labels of a recording, in order: those beside it, else those said meanwhile.

    Those beside it count if they are of this recording, see `label_notes`. Raises RecordingError,
    naming file and line, for a file beside it that is none, and for labels that cannot be of a
    recording that is whole.
    """
    beside = _written_beside(content)
    if beside is None or _is_of_another(content, beside):
        return _said(content)
    _check_times(content, beside)
    return beside.stretches


def label_notes(content: RecordingContent) -> tuple[str, ...]:
    """Return what should be known of the labels beside a recording, a sentence each.

    Raises as `labels_of` does.
    """
    beside = _written_beside(content)
    if beside is None:
        return ()
    name = labels_beside(content.path).name
    if _is_of_another(content, beside):
        return (
            f"the labels in {name} are of another recording that had this name: they do not count; "
            "remove that file, or, if they are of this one, its line with the fingerprint",
        )
    _check_times(content, beside)
    return tuple(
        f"{name}:{line}: label {told(stretch, content.first_ns)} ends after the recording, which "
        f"lasts {content.duration_s:.3f} s"
        for stretch, line in zip(beside.stretches, beside.lines, strict=True)
        if ends_after(stretch, content.last_ns)
    )


def read_labels(file: Path, first_ns: int) -> tuple[Stretch, ...]:
    """Return the labels in a file whose seconds count from `first_ns`.

    Raises RecordingError, naming file and line, for a row that is none or overlaps another.
    """
    return _read(file, first_ns).stretches


def write_labels(
    content: RecordingContent, stretches: Sequence[Stretch], *, found: bool = False
) -> Path | None:
    """Write labels beside a recording as they are read, to the ns, whole or not at all.

    Those that were `found` carry a remark that says so. Where labels of another recording lie
    there, they are moved aside; returns where to. Raises RecordingError where the file cannot be
    written.
    """
    file = labels_beside(content.path)
    rows = io.StringIO()
    writer = csv.writer(rows, lineterminator="\n")
    writer.writerow(HEADER)
    for stretch in stretches:
        times = (_seconds(at - content.first_ns) for at in (stretch.begin_ns, stretch.end_ns))
        writer.writerow([*times, stretch.state])
    try:
        rows.write(f"{COMMENT} of {fingerprint_of(content.path)}\n")
        text = rows.getvalue()
        aside = _moved_aside(content)
        with written_whole(file) as unfinished:
            unfinished.write_text(marked(text) if found else text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise RecordingError(f"{file}: cannot be written: {error.strerror or error}") from error
    return aside


def has_fingerprint(file: Path) -> bool:
    """Return whether a file of labels says of which recording they are; False for none at all."""
    try:
        return _read(file, 0).fingerprint is not None
    except RecordingError:
        return False


def _written_beside(content: RecordingContent) -> _Written | None:
    beside = labels_beside(content.path)
    return _read(beside, content.first_ns) if beside.is_file() else None


def _is_of_another(content: RecordingContent, written: _Written) -> bool:
    try:
        return written.fingerprint is not None and not is_of(written.fingerprint, content.path)
    except OSError as error:
        raise RecordingError(f"{content.path}: cannot be read: {error.strerror}") from error


def _moved_aside(content: RecordingContent) -> Path | None:
    """Where labels of another recording were moved to, lest they are lost."""
    beside = labels_beside(content.path)
    try:
        written = _written_beside(content)
    except RecordingError:
        return None
    if written is None or not _is_of_another(content, written):
        return None
    number = 1
    while (
        aside := beside.with_name(f"{content.path.stem}.labels-of-another-{number}.csv")
    ).exists():
        number += 1
    beside.rename(aside)
    return aside


def _check_times(content: RecordingContent, written: _Written) -> None:
    """Raise RecordingError where labels were written in another unit, or are of no part of it."""
    file = labels_beside(content.path)
    unit = misread_unit(written.stretches, content.first_ns, content.last_ns)
    if unit:
        raise RecordingError(
            f"{file}: the recording lasts {content.duration_s:.3f} s, and the times of these "
            f"labels read like {unit}"
        )
    if not content.whole or content.gaps:
        # What they are of may be among what is missing.
        return
    for stretch, line in zip(written.stretches, written.lines, strict=True):
        outside = stretch.begin_ns >= content.last_ns or stretch.begin_ns < content.first_ns
        if outside or ends_after(stretch, content.last_ns + to_ns(FAR_BEYOND_S)):
            raise RecordingError(
                f"{file}:{line}: label {told(stretch, content.first_ns)} is outside of the "
                f"recording, which lasts {content.duration_s:.3f} s: label what is in it"
            )


def _read(file: Path, first_ns: int) -> _Written:
    rows = csv.reader(io.StringIO(_text(file), newline=""), strict=True)
    stretches: list[Stretch] = []
    lines: list[int] = []
    fingerprint = None
    try:
        _check_header(file, next(rows, []))
        for row in rows:
            if row and row[0].startswith(COMMENT):
                fingerprint = fingerprint_in(row[0]) or fingerprint
            elif any(field.strip() for field in row):
                where = f"{file}:{rows.line_num}"
                stretches.append(_stretch(where, row, first_ns, stretches))
                lines.append(rows.line_num)
    except csv.Error as error:
        raise RecordingError(
            f"{file}:{rows.line_num}: not a CSV file: {error}: see that each quote is closed"
        ) from error
    return _Written(tuple(stretches), tuple(lines), fingerprint)


def _text(file: Path) -> str:
    try:
        with file.open("rb") as stream:
            data = stream.read(LARGEST_BYTES + 1)
        if len(data) > LARGEST_BYTES:
            raise RecordingError(
                f"{file}: has more than {LARGEST_BYTES / 1e6:.0f} MB: expected a file of labels"
            )
        text = data.decode("utf-8-sig")
    except OSError as error:
        raise RecordingError(f"{file}: cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise RecordingError(f"{file}:{line}: not UTF-8 text: save it as CSV in UTF-8") from error
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise RecordingError(f"{file}:{line}: binary data, expected a CSV file")
    return text


def _check_header(file: Path, header: Sequence[str]) -> None:
    columns = [column.strip().lower() for column in header]
    if columns == HEADER:
        return
    separated = separator_in(",".join(header))
    hint = "" if separated is None else f", separated by commas instead of {separated}"
    raise RecordingError(f"{file}:1: expected the header {','.join(HEADER)}{hint}")


def _stretch(where: str, row: Sequence[str], first_ns: int, before: Sequence[Stretch]) -> Stretch:
    fields = [field.strip() for field in row]
    try:
        begin_s, end_s = map(number_in, fields[:2])
        state, *others = fields[2:]
        if any(others):
            raise ValueError("a field too many")
    except ValueError:
        shown = repr(fields)
        raise RecordingError(
            f"{where}: expected {','.join(HEADER)}, not "
            f"{shown if len(shown) <= _SHOWN else shown[:_SHOWN] + '…'}"
        ) from None
    possible = begin_s < end_s and max(-begin_s, end_s) <= MOST_SECONDS
    if not (possible and state and state.isprintable()):
        raise RecordingError(f"{where}: expected begin_s below end_s, in seconds, and a state")
    stretch = Stretch(first_ns + to_ns(begin_s), first_ns + to_ns(end_s), state)
    if before and stretch.begin_ns < before[-1].end_ns:
        raise RecordingError(
            f"{where}: begins before the label above it ends: let each end where the next one "
            "begins, in the order of time"
        )
    if len(before) == MOST_LABELS:
        raise RecordingError(f"{where}: more than {MOST_LABELS} labels")
    return stretch


def _seconds(ns: int) -> str:
    """Seconds with as many digits as they need."""
    whole, rest = divmod(abs(ns), NS_PER_S)
    return f"{'-' if ns < 0 else ''}{whole}.{rest:09}".rstrip("0").rstrip(".")


def _said(content: RecordingContent) -> tuple[Stretch, ...]:
    """Labels said meanwhile; one that names a step begins where that step did."""
    said = [
        (recorded.log_ns, label.state.strip(), (label.clock, label.step))
        for recorded, _, label in islice(content.of(Label), MOST_LABELS + 1)
    ]
    if len(said) > MOST_LABELS:
        raise RecordingError(f"{content.path}: has more than {MOST_LABELS} labels")
    named = {step for _, _, step in said}
    began_ns = {
        began: recorded.log_ns
        for recorded, envelope, step in (content.of(Step) if named else ())
        if (began := (envelope.source.boot, step.index + 1)) in named
    }
    begins = [began_ns.get(step, log_ns) for log_ns, _, step in said]
    return tuple(
        Stretch(begin, end, state)
        for begin, end, (_, state, _) in zip(
            begins, [*begins[1:], content.last_ns + 1], said, strict=False
        )
        if state and begin < end
    )
