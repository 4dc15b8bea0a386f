"""The motion in a recording at a glance, to set labels by; and labels set by it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.recordings.demonstrations import whole_way
from hmcs.recordings.labels import labels_beside, labels_of, write_labels
from hmcs.recordings.parts import SUFFIX
from hmcs.recordings.reading import RecordingContent, RecordingError
from hmcs.recordings.stretches import NS_PER_S, check_within, of_seconds

MOST_SAMPLES = 1000


class MotionOutline(NamedTuple):
    """The way of the engaged hand in a recording of n samples and m labels."""

    duration_s: float
    """From its first message to its last."""
    time_s: NDArray[np.float64]
    """Since its first message, rising, shape (n,)."""
    positions: NDArray[np.float64]
    """m, operator frame, shape (n, 3); without jumps, as demonstrations have it."""
    begin_s: NDArray[np.float64]
    """Where each label begins, s since the first message, shape (m,)."""
    end_s: NDArray[np.float64]
    """Where it ends, shape (m,)."""
    states: tuple[str, ...]


def outlined(content: RecordingContent, most: int = MOST_SAMPLES) -> MotionOutline:
    """Return the motion in a recording and the labels that count, at most `most` samples of it.

    Raises RecordingError as `labels_of` does.
    """
    labels = labels_of(content)
    way = whole_way(content)
    time_s, positions = np.zeros(0), np.zeros((0, 3))
    if way is not None:
        count = min(most, len(way.time_s))
        chosen = np.unique(np.linspace(0, len(way.time_s) - 1, count).round().astype(int))
        time_s, positions = way.time_s[chosen], way.positions[chosen]
    at = np.array([label[:2] for label in labels], dtype=np.int64).reshape(-1, 2)
    begin_s, end_s = ((at - content.first_ns) / NS_PER_S).T
    return MotionOutline(
        content.duration_s, time_s, positions, begin_s, end_s, tuple(one.state for one in labels)
    )


def set_labels(
    content: RecordingContent,
    begin_s: Sequence[float],
    end_s: Sequence[float],
    states: Sequence[str],
) -> Path:
    """Write labels, in s since its first message, beside a recording; return where.

    Raises LabelError where they cannot be of it; nothing is written then.
    """
    stretches = of_seconds(begin_s, end_s, states, content.first_ns)
    check_within(stretches, content.first_ns, content.last_ns)
    file = labels_beside(content.path)
    write_labels(file, stretches, content.first_ns)
    return file


def recordings_in(folder: Path) -> list[Path]:
    """Return the recordings in a folder, the newest first."""
    files = [file for file in folder.glob(f"*{SUFFIX}") if file.is_file()]
    return sorted(files, key=lambda file: (file.stat().st_mtime_ns, file.name), reverse=True)


def recording_named(folder: Path, name: str) -> Path:
    """Return the recording of that name in a folder, the newest one where it is empty.

    Raises RecordingError where there is none; a name never leads out of the folder.
    """
    there = recordings_in(folder)
    if not name and there:
        return there[0]
    for file in there:
        if file.name == name:
            return file
    raise RecordingError(
        f"{folder}: there is no recording {name!r}: choose of "
        f"{', '.join(file.name for file in there) or 'none; record one'}"
        if name
        else f"{folder}: there are no recordings yet: record one"
    )
