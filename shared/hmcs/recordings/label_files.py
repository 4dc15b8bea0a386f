"""Files of labels as people and programs write them: CSV with a header, a label in each row.

A line that begins with # is a remark. One of them may say of which recording the labels are, by its
fingerprint.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from hmcs.plain_numbers import number_in, separator_in
from hmcs.recordings.fingerprints import Fingerprint, fingerprint_in
from hmcs.recordings.generated_marker import COMMENT
from hmcs.recordings.reading import RecordingError
from hmcs.recordings.stretches import NS_PER_S, Stretch, to_ns

HEADER = ["begin_s", "end_s", "state"]
LARGEST_BYTES = 8 * 1024 * 1024
"""Of a file of labels; of a hundred thousand it has less."""
MOST_LABELS = 100_000
"""Of a recording: one for every third of a second of ten hours."""
MOST_SECONDS = 1e19
"""What is larger is no time, not even in nanoseconds since 1970."""
_SHOWN = 80


class LabelFile(NamedTuple):
    """What stands in a file of labels."""

    stretches: tuple[Stretch, ...]
    """In the order of time; they do not overlap."""
    lines: tuple[int, ...]
    """Of each stretch in the file."""
    fingerprint: Fingerprint | None
    """Of the recording they are of, where the file says so."""


def read_labels(file: Path, first_ns: int) -> LabelFile:
    """Return the labels in a file whose seconds count from `first_ns`.

    Raises RecordingError, naming file and line, for a file that is no CSV of labels, and a row that
    is none or overlaps another.
    """
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
    return LabelFile(tuple(stretches), tuple(lines), fingerprint)


def labels_text(stretches: Sequence[Stretch], first_ns: int, fingerprint: Fingerprint) -> str:
    """Return what `read_labels` reads, to the ns."""
    rows = io.StringIO()
    writer = csv.writer(rows, lineterminator="\n")
    writer.writerow(HEADER)
    for stretch in stretches:
        times = (_seconds(at - first_ns) for at in (stretch.begin_ns, stretch.end_ns))
        writer.writerow([*times, stretch.state])
    return f"{rows.getvalue()}{COMMENT} of {fingerprint}\n"


def has_fingerprint(file: Path) -> bool:
    """Return whether a file says of which recording its labels are; False where it is none."""
    try:
        return read_labels(file, 0).fingerprint is not None
    except RecordingError:
        return False


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
        raise RecordingError(f"{where}: expected begin_s below end_s, and a state")
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
