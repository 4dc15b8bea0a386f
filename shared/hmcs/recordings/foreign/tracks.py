"""What a sensor said over time, and demonstrations made of the tracks of several sensors."""

from __future__ import annotations

from array import array
from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.quaternions import UNIT_WITHIN, continuous
from hmcs.recordings.demonstrations import LEAST_SAMPLES, MOST_SAMPLES
from hmcs.recordings.reading import RecordingError
from hmcs.recordings.stretches import NS_PER_S

LATEST_NS = 2**62
"""Of times; what is later was never a clock's."""
LARGEST = 1e12
"""Of numbers; what is larger was never measured, and its square is soon none."""
FORCE_MISSING_S = 0.1
"""So long the force may begin after the motion, or end before it, without a remark."""

Times = NDArray[np.int64]


class Track(NamedTuple):
    """Samples of one sensor."""

    time_ns: Times
    """Shape (T,), rising."""
    values: Array
    """Shape (T, n)."""


class Mark(NamedTuple):
    """A moment from which on the motion is of one state."""

    time_ns: int
    state: str


class TrackMaker:
    """Gathers the samples of one sensor, checked one by one."""

    def __init__(self, where: str, width: int) -> None:
        """`where` begins each message; a sample has `width` numbers."""
        self._where, self._width = where, width
        self._times, self._values = array("q"), array("d")
        self.doubled = 0
        """Samples of the time of the one before; the later counts."""

    def __len__(self) -> int:
        return len(self._times)

    def add(self, time_ns: int, values: Sequence[float]) -> None:
        """Take in one more.

        Raises RecordingError, saying which it is, for one that is not finite, of another width,
        earlier than the one before, or one too many.
        """
        number = len(self._times) + self.doubled + 1
        if len(values) != self._width:
            raise RecordingError(
                f"{self._where}: sample {number} has {len(values)} numbers, expected {self._width}"
            )
        if not all(abs(value) <= LARGEST for value in values):
            raise RecordingError(
                f"{self._where}: sample {number} is {_shown(values)}, expected finite numbers, at "
                f"most {LARGEST:g}: "
                "take it out of the recording, or name another topic by --topic"
            )
        if not 0 <= time_ns < LATEST_NS:
            raise RecordingError(f"{self._where}: sample {number} is of no possible time")
        if self._times and time_ns < self._times[-1]:
            back_s = (self._times[-1] - time_ns) / NS_PER_S
            raise RecordingError(
                f"{self._where}: sample {number} is {back_s:.3f} s earlier than the one before: "
                "times must rise; was a clock set back, or are there two senders? Cut it there"
            )
        if self._times and time_ns == self._times[-1]:
            self.doubled += 1
            del self._times[-1], self._values[-self._width :]
        elif len(self._times) == MOST_SAMPLES:
            raise RecordingError(f"{self._where}: more than {MOST_SAMPLES} samples: cut it")
        self._times.append(time_ns)
        self._values.extend(values)

    def track(self) -> Track:
        """Return what was gathered."""
        values = np.array(self._values, dtype=float).reshape(-1, self._width)
        return Track(np.array(self._times, dtype=np.int64), values)


def demonstration_of(
    name: str,
    where: str,
    motion: Track,
    force: Track | None = None,
    marks: Sequence[Mark] = (),
) -> tuple[Demonstration, list[str]]:
    """Return the demonstration that tracks make, and what should be known of it.

    `motion` has positions, m, shape (T, 3), or with quaternions x y z w behind them, shape (T, 7).
    Times count from its first sample. The force is taken between its samples in a straight line.
    Raises RecordingError for fewer than two samples and for a quaternion that is no rotation.
    """
    if len(motion.time_ns) < LEAST_SAMPLES:
        raise RecordingError(
            f"{where}: {len(motion.time_ns)} position(s), expected {LEAST_SAMPLES} at least: is "
            "the recording cut off, or another topic the motion? Name it by --topic"
        )
    orientations = None
    if motion.values.shape[1] > 3:
        orientations = _rotations(where, motion.values[:, 3:7])
    wrenches, notes = None, list[str]()
    if force is not None and len(force.time_ns):
        notes = _coverage(where, motion.time_ns, force.time_ns)
        wrenches = between(motion.time_ns, force)
    time_s = (motion.time_ns - motion.time_ns[0]) / NS_PER_S
    states = _states(motion.time_ns, marks)
    shown = Demonstration(name, time_s, motion.values[:, :3], states, orientations, wrenches)
    return shown, notes


def between(time_ns: Times, track: Track) -> Array:
    """Return a track's values at other times; before its first and after its last sample those."""
    own_s, at_s = ((times - track.time_ns[0]) / NS_PER_S for times in (track.time_ns, time_ns))
    return np.stack([np.interp(at_s, own_s, each) for each in track.values.T], axis=1)


def _rotations(where: str, quaternions: Array) -> Array:
    lengths = np.linalg.norm(quaternions, axis=1)
    wrong = np.flatnonzero(np.abs(lengths - 1.0) > UNIT_WITHIN)
    if len(wrong):
        raise RecordingError(
            f"{where}: the orientation of sample {wrong[0] + 1} is "
            f"{_shown(quaternions[wrong[0]].tolist())}, expected a rotation: a quaternion x y z w "
            "of length 1"
        )
    return continuous(quaternions / lengths[:, None])


def _coverage(where: str, motion_ns: Times, force_ns: Times) -> list[str]:
    late_s = max(0, int(force_ns[0] - motion_ns[0])) / NS_PER_S
    early_s = max(0, int(motion_ns[-1] - force_ns[-1])) / NS_PER_S
    if max(late_s, early_s) <= FORCE_MISSING_S:
        return []
    return [
        f"{where}: the force begins {late_s:.2f} s after the motion and ends {early_s:.2f} s "
        "before it: it is held at its first and last value there"
    ]


def _states(time_ns: Times, marks: Sequence[Mark]) -> tuple[str | None, ...]:
    if not marks:
        return (None,) * len(time_ns)
    ordered = sorted(marks)
    begins = [mark.time_ns for mark in ordered]
    found = (bisect_right(begins, at) - 1 for at in time_ns.tolist())
    return tuple(ordered[index].state if index >= 0 else None for index in found)


def _shown(values: Sequence[float]) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"
