"""What the operator truly did: which sample of the performance was played when, and its label."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.recognition.scoring import NONE
from hmcs_demo.recording import Motions

IntArray = NDArray[np.int64]

SAMPLE_TOLERANCE_M = 1e-4
"""How well the hand seen on the bus must fit the performance for its labels to be trusted."""
PAUSE_S = 0.1
"""In a longer time between two samples the recording may have waited."""
COMPARED_SAMPLES = 50
"""So many samples tell how long it did."""
NS_PER_S = 1_000_000_000


class RunError(Exception):
    """A run that cannot be measured, or did not come about; says why."""


class TrueStateInterval(NamedTuple):
    """A stretch of the performance that truly is of one state."""

    state: int
    """Index among the states of the model."""
    begin: int
    """Number of its first played sample."""
    end: int
    """Number of its last one."""


class SampleClock:
    """Tells which sample of the performance each operator sample was, and what it truly was.

    The input device plays on the grid of its rate: played sample k is the hand k/rate after it
    began to move, the time its operator waited meanwhile left out. Which k a sample was is read off
    its time and, to the sample and where it waited, off its position.
    Raises RunError where the motions do not show this performance.
    """

    def __init__(
        self,
        performance: Demonstration,
        states: tuple[str, ...],
        rate_hz: float,
        motions: Motions,
    ) -> None:
        moving = motions.dead_man
        if not moving.any():
            raise RunError("no motion was seen on the bus: the logs of the services say why")
        captured_ns = motions.captured_ns[moving]
        played_s = performance.time_s - performance.time_s[0]
        grid_s = np.arange(int(played_s[-1] * rate_hz + 1.5)) / rate_hz
        own = np.searchsorted(played_s, grid_s + 1e-9, side="right") - 1
        names = {name: index for index, name in enumerate(states)}
        named = [names.get(label or "", NONE) for label in performance.states]
        self.labels: IntArray = np.array(named, dtype=np.int64)[own]
        """Index of the true state of each played sample, or NONE."""
        self.positions = np.stack(
            [np.interp(grid_s, played_s, performance.positions[:, axis]) for axis in range(3)],
            axis=1,
        )
        """The hand at each played sample, m, shape (n, 3)."""
        self._samples = motions.sample[moving]
        self._numbers = _played(
            self.positions,
            (captured_ns - captured_ns[0]) / NS_PER_S * rate_hz,
            motions.position[moving],
            PAUSE_S * rate_hz,
        )
        self._begin_ns = int(captured_ns[0] - self._numbers[0] / rate_hz * NS_PER_S)
        self._seconds = self.seconds(captured_ns)
        self.motion_s = float(self._seconds[-1])

    def number(self, sample: IntArray) -> IntArray:
        """Return which played samples these operator samples were."""
        numbers = np.interp(sample, self._samples, self._numbers)
        return np.asarray(np.rint(numbers).astype(np.int64))

    def seconds(self, local_ns: Array | IntArray) -> Array:
        """Return times of the machine's monotonic clock as s after the hand began to move."""
        return np.asarray((local_ns - self._begin_ns) / NS_PER_S)

    def when(self, number: int) -> float:
        """Return when a sample was played, s after the hand began to move."""
        return float(np.interp(number, self._numbers, self._seconds))

    @property
    def segments(self) -> tuple[TrueStateInterval, ...]:
        """The true segments, one after the other; the last sample of one begins the next."""
        edges = [0, *(np.flatnonzero(np.diff(self.labels)) + 1).tolist(), len(self.labels) - 1]
        return tuple(
            TrueStateInterval(int(self.labels[begin]), begin, end)
            for begin, end in itertools.pairwise(edges)
        )


def _played(positions: Array, guess: Array, seen: Array, pause: float) -> IntArray:
    """The number of the played sample nearest to each position seen, close to the guess.

    The guess is that of a hand that never waits; it may have, in gaps of more than `pause` samples.
    """
    shifts = np.array([0, 1, -1, 2, -2])
    rounded = np.rint(guess).astype(np.int64)
    gaps = np.flatnonzero(np.diff(guess) > pause) + 1
    for begin, end in itertools.pairwise([*gaps.tolist(), len(guess)]):
        run = slice(begin, min(begin + COMPARED_SAMPLES, end))
        waits = np.arange(int(np.ceil(guess[begin] - guess[begin - 1])) + 1)
        numbers = np.clip(rounded[run] - waits[:, None], 0, len(positions) - 1)
        off_m = np.linalg.norm(positions[numbers] - seen[run], axis=2).mean(axis=1)
        rounded[begin:] -= waits[np.argmin(off_m)]
    candidates = np.clip(rounded[:, None] + shifts, 0, len(positions) - 1)
    off_m = np.abs(positions[candidates] - seen[:, None]).max(axis=2)
    best = np.argmin(np.round(off_m, 9), axis=1)
    rows = np.arange(len(seen))
    worst_m = float(off_m[rows, best].max())
    if worst_m > SAMPLE_TOLERANCE_M:
        raise RunError(
            f"the hand seen on the bus is up to {1e3 * worst_m:.2f} mm off the performance: "
            "another input device plays in this cell"
        )
    return np.asarray(candidates[rows, best])
