"""Which part of the task each moment of a recording was: said meanwhile, or written beside it.

Labels said while the hand moved are `Label` messages. Labels set afterwards stand in a CSV file
beside the recording, `NAME.labels.csv` with the header `begin_s,end_s,state`, in seconds since the
recording's first message; they count instead of those said. The recording is never changed. A line
of that file that begins with # is a remark.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from hmcs.bus.messages import Label, Step
from hmcs.recordings.found import COMMENT, is_as_found, marked
from hmcs.recordings.reading import RecordingContent, RecordingError
from hmcs.recordings.stretches import NS_PER_S, Stretch, to_ns
from hmcs.whole_files import written_whole

HEADER = ["begin_s", "end_s", "state"]
How = Literal["said meanwhile", "set afterwards", "found"]


def labels_beside(recording: Path) -> Path:
    """Return where labels of a recording are written that are set afterwards."""
    return recording.with_name(f"{recording.stem}.labels.csv")


def how_labeled(content: RecordingContent) -> How:
    """Return how the labels of a recording were set, those that count."""
    beside = labels_beside(content.path)
    if not beside.is_file():
        return "said meanwhile"
    return "found" if is_as_found(beside) else "set afterwards"


def labels_of(content: RecordingContent) -> tuple[Stretch, ...]:
    """Return the labels of a recording, in order: those beside it, else those said meanwhile.

    Raises RecordingError for a file beside it that is none, naming the line.
    """
    beside = labels_beside(content.path)
    if beside.is_file():
        return read_labels(beside, content.first_ns)
    return _said(content)


def read_labels(file: Path, first_ns: int) -> tuple[Stretch, ...]:
    """Return the labels in a file whose seconds count from `first_ns`.

    Raises RecordingError, naming file and line, for a row that is none or overlaps another.
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise RecordingError(f"{file}: no text that can be read: {error}") from error
    stretches: list[Stretch] = []
    rows = csv.reader(io.StringIO(text, newline=""))
    if next(rows, []) != HEADER:
        raise RecordingError(f"{file}:1: expected the header {','.join(HEADER)}")
    for row in rows:
        if not row or row[0].startswith(COMMENT):
            continue
        where = f"{file}:{rows.line_num}"
        try:
            begin_s, end_s = float(row[0]), float(row[1])
            state = row[2].strip()
        except (IndexError, ValueError):
            raise RecordingError(f"{where}: expected {','.join(HEADER)}, not {row}") from None
        if not (math.isfinite(begin_s) and math.isfinite(end_s) and begin_s < end_s and state):
            raise RecordingError(f"{where}: expected begin_s below end_s, and a state")
        stretch = Stretch(first_ns + to_ns(begin_s), first_ns + to_ns(end_s), state)
        if stretches and stretch.begin_ns < stretches[-1].end_ns:
            raise RecordingError(
                f"{where}: begins before the label above it ends: let each end where the next one "
                "begins, in the order of time"
            )
        stretches.append(stretch)
    return tuple(stretches)


def write_labels(
    file: Path, stretches: Sequence[Stretch], first_ns: int, *, found: bool = False
) -> None:
    """Write labels as `read_labels` reads them, to the ns, whole or not at all.

    Those that were `found` carry a remark that says so.
    """
    rows = io.StringIO()
    writer = csv.writer(rows, lineterminator="\n")
    writer.writerow(HEADER)
    for stretch in stretches:
        times = (_seconds(at - first_ns) for at in (stretch.begin_ns, stretch.end_ns))
        writer.writerow([*times, stretch.state])
    text = rows.getvalue()
    with written_whole(file) as unfinished:
        unfinished.write_text(marked(text) if found else text, encoding="utf-8", newline="\n")


def _seconds(ns: int) -> str:
    """Seconds with as many digits as they need."""
    return f"{ns / NS_PER_S:.9f}".rstrip("0").rstrip(".")


def _said(content: RecordingContent) -> tuple[Stretch, ...]:
    """Labels said meanwhile; one that names a step begins where that step did."""
    began_ns: dict[tuple[str, int], int] = {}
    for recorded, envelope, step in content.of(Step):
        began_ns[envelope.source.boot, step.index + 1] = recorded.log_ns
    said = [
        (began_ns.get((label.clock, label.step), recorded.log_ns), label.state)
        for recorded, _, label in content.of(Label)
    ]
    end_ns = content.messages[-1].log_ns + 1 if content.messages else 0
    begins = [*(begin for begin, _ in said), end_ns]
    return tuple(
        Stretch(begin, end, state)
        for (begin, state), end in zip(said, begins[1:], strict=True)
        if state and begin < end
    )
