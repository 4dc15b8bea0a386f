"""What a fixture does at each sample of the operator, kept small: an hour has a million."""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence
from typing import NamedTuple, overload

import numpy as np
from numpy.typing import NDArray


class FixtureOutput(NamedTuple):
    """What a fixture does, or did, at one sample of the operator."""

    state: str
    """The task state whose fixture is applied; empty in free motion."""
    reason: str
    factor: float
    """k, ½ in free motion."""
    compliance: float
    direction: NDArray[np.float64]
    """The preferred one, unit length, or zero in free motion, shape (3,)."""
    velocity: NDArray[np.float64]
    """Commanded, m/s, shape (3,)."""
    off_guide_m: float | None
    """How far the robot is beside the guide; None where nobody knows."""
    engaged: bool

    @property
    def guides(self) -> bool:
        """Whether it is stiffer than free motion."""
        return bool(self.state)


class Tick(NamedTuple):
    """One sample of the operator, and what is and was done with it."""

    log_ns: int
    device: str
    """Boot of the input device."""
    sample: int
    """Its number."""
    now: FixtureOutput
    then: FixtureOutput | None
    """None where no fixture was recorded to have answered it."""


class _Words:
    """Words by numbers."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}
        self._words: list[str] = []

    def number(self, word: str) -> int:
        if word not in self._numbers:
            self._numbers[word] = len(self._words)
            self._words.append(word)
        return self._numbers[word]

    def word(self, number: int) -> str:
        return self._words[number]


class _FixtureOutputs:
    """A row for everything that is done."""

    def __init__(self, words: _Words) -> None:
        self._words = words
        self._numbers = array("d")
        """Factor, compliance, direction, velocity, how far off the guide: 9 of each."""
        self._named = array("L")
        """State, reason, whether engaged: 3 of each."""

    def add(self, did: FixtureOutput) -> int:
        """Return the number of the new row."""
        off_m = math.nan if did.off_guide_m is None else did.off_guide_m
        self._numbers.extend((did.factor, did.compliance, *did.direction, *did.velocity, off_m))
        named = map(self._words.number, (did.state, did.reason))
        self._named.extend((*named, did.engaged))
        return len(self._named) // 3 - 1

    def did(self, row: int) -> FixtureOutput:
        factor, compliance, *vectors, off_m = self._numbers[9 * row : 9 * row + 9]
        state, reason, engaged = self._named[3 * row : 3 * row + 3]
        return FixtureOutput(
            self._words.word(state),
            self._words.word(reason),
            factor,
            compliance,
            np.array(vectors[:3]),
            np.array(vectors[3:]),
            None if math.isnan(off_m) else off_m,
            bool(engaged),
        )


class Ticks(Sequence[Tick]):
    """The samples of an operator in their order, with what is and was done at each."""

    def __init__(self) -> None:
        self._words = _Words()
        self._now, self._then = _FixtureOutputs(self._words), _FixtureOutputs(self._words)
        self._log_ns, self._devices = array("q"), array("L")
        self._samples: list[int] = []
        """Numbers that a sender may choose as large as it likes."""
        self._rows_then: dict[tuple[int, int], int] = {}
        """Of what was done, by device and sample."""

    def add(self, log_ns: int, device: str, sample: int, now: FixtureOutput) -> None:
        """Add a sample and what is done at it."""
        self._log_ns.append(log_ns)
        self._devices.append(self._words.number(device))
        self._samples.append(sample)
        self._now.add(now)

    def add_then(self, device: str, sample: int, then: FixtureOutput) -> None:
        """Note what was done at a sample, whether that was added yet or not."""
        self._rows_then[self._words.number(device), sample] = self._then.add(then)

    def __len__(self) -> int:
        return len(self._log_ns)

    @overload
    def __getitem__(self, index: int) -> Tick: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Tick, ...]: ...
    def __getitem__(self, index: int | slice) -> Tick | tuple[Tick, ...]:
        """Return samples as they were added."""
        if isinstance(index, slice):
            return tuple(self[number] for number in range(*index.indices(len(self))))
        number = range(len(self))[index]
        device, sample = self._devices[number], self._samples[number]
        row = self._rows_then.get((device, sample))
        return Tick(
            self._log_ns[number],
            self._words.word(device),
            sample,
            self._now.did(number),
            None if row is None else self._then.did(row),
        )
