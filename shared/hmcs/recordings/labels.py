"""Which part of the task each moment of a recording was: said meanwhile, or written beside it.

Labels said while the hand moved are `Label` messages. Labels set afterwards stand in a CSV file
beside the recording, `NAME.labels.csv` with the header `begin_s,end_s,state`, in seconds since the
recording's first message; they count instead of those said. The recording is never changed. A line
of that file that begins with # is a remark. One of them has the recording's fingerprint: beside
another recording of the same name the labels do not count. A file without it is taken as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Literal

from hmcs.bus.messages import Label, Step
from hmcs.recordings.fingerprints import fingerprint_of, is_of
from hmcs.recordings.generated_marker import is_unchanged_generated, with_generated_marker
from hmcs.recordings.label_files import MOST_LABELS, LabelFile, labels_text, read_labels
from hmcs.recordings.reading import RecordingContent, RecordingError
from hmcs.recordings.stretches import Stretch, ends_after, misread_unit, stretch_text, to_ns
from hmcs.whole_files import written_whole

SUFFIX = ".labels.csv"
How = Literal["said meanwhile", "set afterwards", "found"]
FAR_BEYOND_S = 1.0
"""Who wrote a label that ends later than the recording by more than this meant something else than
a rounded number."""


def labels_beside(recording: Path) -> Path:
    """Return where labels of a recording are written that are set afterwards."""
    return recording.with_name(f"{recording.stem}{SUFFIX}")


def how_labeled(content: RecordingContent) -> How:
    """Return how the labels of a recording were set, those that count; raises as `labels_of`."""
    beside = _written_beside(content)
    if beside is None or _is_of_another(content, beside):
        return "said meanwhile"
    return "found" if is_unchanged_generated(labels_beside(content.path)) else "set afterwards"


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
        f"{name}:{line}: label {stretch_text(stretch, content.first_ns)} ends after the "
        f"recording, which lasts {content.duration_s:.3f} s"
        for stretch, line in zip(beside.stretches, beside.lines, strict=True)
        if ends_after(stretch, content.last_ns)
    )


def write_labels(
    content: RecordingContent,
    stretches: Sequence[Stretch],
    *,
    found: bool = False,
    target: Path | None = None,
) -> Path | None:
    """Write labels beside a recording as they are read, to the ns, whole or not at all.

    Or to the file `target`. Those that were `found` carry a remark that says so. Where labels of
    another recording lie beside it, they are moved aside; returns where to. Raises RecordingError
    where the file cannot be written.
    """
    beside = labels_beside(content.path)
    file = beside if target is None else target
    try:
        text = labels_text(stretches, content.first_ns, fingerprint_of(content.path))
        aside = _moved_aside(content) if file == beside else None
        with written_whole(file) as unfinished:
            unfinished.write_text(
                with_generated_marker(text) if found else text, encoding="utf-8", newline="\n"
            )
    except OSError as error:
        raise RecordingError(f"{file}: cannot be written: {error.strerror or error}") from error
    return aside


def _written_beside(content: RecordingContent) -> LabelFile | None:
    beside = labels_beside(content.path)
    return read_labels(beside, content.first_ns) if beside.is_file() else None


def _is_of_another(content: RecordingContent, written: LabelFile) -> bool:
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


def _check_times(content: RecordingContent, written: LabelFile) -> None:
    """Raise RecordingError where labels were written in another unit, or are of no part of it."""
    file = labels_beside(content.path)
    all_there = content.whole and not content.gaps
    last_ns = content.last_ns if all_there else None
    unit = misread_unit(written.stretches, content.first_ns, last_ns)
    if unit:
        raise RecordingError(
            f"{file}: the recording lasts {content.duration_s:.3f} s, and the times of these "
            f"labels read like {unit}"
        )
    if not all_there:
        # What they are of may be among what is missing.
        return
    for stretch, line in zip(written.stretches, written.lines, strict=True):
        outside = stretch.begin_ns >= content.last_ns or stretch.begin_ns < content.first_ns
        if outside or ends_after(stretch, content.last_ns + to_ns(FAR_BEYOND_S)):
            raise RecordingError(
                f"{file}:{line}: label {stretch_text(stretch, content.first_ns)} is outside of the "
                f"recording, which lasts {content.duration_s:.3f} s: label what is in it"
            )


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
