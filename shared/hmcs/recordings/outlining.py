"""The motion in a recording at a glance, to set labels by; and labels set by it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.recordings.demonstrations import LEAST_SAMPLES, way_of
from hmcs.recordings.file_rotation import SUFFIX
from hmcs.recordings.hands import hand_of
from hmcs.recordings.labels import labels_beside, labels_of, write_labels
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
    time_s, positions = _thinned_out(content, most)
    begin_s, end_s = (
        np.array([(at - content.first_ns) / NS_PER_S for at in times])
        for times in ([one.begin_ns for one in labels], [one.end_ns for one in labels])
    )
    return MotionOutline(
        content.duration_s, time_s, positions, begin_s, end_s, tuple(one.state for one in labels)
    )


def _thinned_out(
    content: RecordingContent, most: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times and positions of the hand's way, at most so many, evenly chosen of all.

    It is gone over twice, to be counted and to be chosen of: it may be too long to be held.
    """
    count = sum(1 for _ in way_of(hand_of(content)))
    if count < LEAST_SAMPLES:
        return np.zeros(0), np.zeros((0, 3))
    chosen = np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(int))
    wanted = set(chosen.tolist())
    passed = [each for number, each in enumerate(way_of(hand_of(content))) if number in wanted]
    return (
        np.array([(each.log_ns - content.first_ns) / NS_PER_S for each in passed]),
        np.array([each.position for each in passed]),
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
    write_labels(content, stretches)
    return labels_beside(content.path)


def recordings_in(folder: Path) -> list[Path]:
    """Return the recordings in a folder, the newest first."""
    found = []
    for file in folder.glob(f"*{SUFFIX}"):
        try:
            if file.is_file():
                found.append((file.stat().st_mtime_ns, file.name, file))
        except OSError:
            # It was moved away a moment ago.
            continue
    return [file for _, _, file in sorted(found, reverse=True)]


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
