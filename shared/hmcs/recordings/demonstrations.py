"""Recordings as demonstrations: the path of the engaged hand, with the labels it was given."""

from __future__ import annotations

import math
from array import array
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.motion.demonstrations import Demonstration
from hmcs.recordings.hands import Sample, hand_of
from hmcs.recordings.labels import labels_of
from hmcs.recordings.reading import RecordingContent, RecordingError
from hmcs.recordings.stretches import NS_PER_S, Stretch

LEAST_SAMPLES = 2
BACK_SHARE = 0.1
"""A hand is back where it began once it is nearer than this share of how far its way reaches."""
MOST_SAMPLES = 4_000_000
"""Of a demonstration, 32 to 120 bytes each: a device of 1 kHz makes as many in more than an hour,
which is as long as a recorder lets a file become."""
MOST_DEMONSTRATIONS = 10_000
"""Of a recording: three in a second for an hour."""

Point = tuple[float, ...]


class Passed(NamedTuple):
    """A point of the engaged hand's way."""

    log_ns: int
    position: Point
    """m, operator frame, from where the hand began; without jumps."""
    sample: Sample


def demonstrations_of(content: RecordingContent) -> list[Demonstration]:
    """Return the demonstrations of a recording, their times in s since its first message.

    Where it has labels there is one for every run of labeled motion, without a stretch between;
    else there is one, without labels; each is of one input device. Motion made with the dead-man
    released or the clutch pressed is taken out, so that the path has no jumps. Raises
    RecordingError as `labels_of` does, and for one of more than MOST_SAMPLES.
    """
    labels = labels_of(content)
    begins = [label.begin_ns for label in labels]

    def state_at(log_ns: int) -> str | None:
        index = bisect_right(begins, log_ns) - 1
        return labels[index].state if index >= 0 and log_ns < labels[index].end_ns else None

    def runs() -> Iterator[tuple[object, Sample]]:
        for sample in hand_of(content):
            known = not labels or state_at(sample.log_ns) is not None
            yield (sample.device if known else None), sample

    return _demonstrations(content, runs(), state_at)


def performances_of(content: RecordingContent) -> list[Demonstration]:
    """Return the demonstrations of a recording without a look at its labels.

    A new one begins where the operator let go and took hold again where the last one had begun,
    nearer to there than to where he let go, and where another input device drives. Else as
    `demonstrations_of`.
    """
    return _demonstrations(content, _performances(hand_of(content)), lambda _: None)


def way_of(samples: Iterable[Sample]) -> Iterator[Passed]:
    """Yield the way of the engaged hand, without jumps and with rising times.

    Of samples logged at one time the last one is a point of it.
    """
    point: Passed | None = None
    before: Sample | None = None
    for sample in samples:
        if not sample.engaged:
            before = None
            continue
        here = sample.motion.position.tolist()
        if point is not None:
            moved = (0.0,) * len(here)
            if before is not None and before.device == sample.device:
                came_from = before.motion.position.tolist()
                moved = tuple(to - at for to, at in zip(here, came_from, strict=True))
            here = [at + by for at, by in zip(point.position, moved, strict=True)]
            if sample.log_ns > point.log_ns:
                yield point
        log_ns = sample.log_ns if point is None else max(sample.log_ns, point.log_ns)
        point = Passed(log_ns, tuple(here), sample)
        before = sample
    if point is not None:
        yield point


def stretches_of(demonstrations: Sequence[Demonstration], first_ns: int) -> tuple[Stretch, ...]:
    """Return the labels of the demonstrations of one recording that began at `first_ns`.

    Read back with that recording they make the very same demonstrations.
    """
    found = []
    for demonstration in demonstrations:
        log_ns = [first_ns + round(at * NS_PER_S) for at in demonstration.time_s]
        for state, samples in demonstration.stretches:
            # The last sample is the first of the next stretch; where there is none it is its own.
            ends = samples.stop == len(log_ns)
            own_to_the_end = ends and demonstration.states[-1] == state
            end_ns = log_ns[samples.stop - 1] + int(own_to_the_end)
            if state is not None and log_ns[samples.start] < end_ns:
                found.append(Stretch(log_ns[samples.start], end_ns, state))
    return tuple(found)


def _performances(samples: Iterable[Sample]) -> Iterator[tuple[object, Sample]]:
    """Each sample with the number of its performance."""
    number = 0
    begun: Point = ()
    last: Point = ()
    """Where the engaged hand was in it first and last."""
    reach_m = 0.0
    let_go = False
    device = ""
    for sample in samples:
        if not sample.motion.dead_man:
            let_go = True
        elif sample.engaged:
            here = tuple(sample.motion.position.tolist())
            again = bool(begun) and (
                sample.device != device or (let_go and _is_back(here, begun, last, reach_m))
            )
            if again:
                number += 1
            if again or not begun:
                begun, reach_m = here, 0.0
            last, device, let_go = here, sample.device, False
            reach_m = max(reach_m, math.dist(here, begun))
        yield number, sample


def _is_back(here: Point, begun: Point, last: Point, reach_m: float) -> bool:
    """Whether a hand that took hold again at a position begins its way anew."""
    return reach_m > 0 and math.dist(here, begun) <= max(
        math.dist(here, last), BACK_SHARE * reach_m
    )


class _Run:
    """The samples of one demonstration."""

    def __init__(self) -> None:
        self.log_ns = array("q")
        self._positions = array("d")
        self._states: list[str | None] = []
        self._senses: dict[str, array[float] | None] = {
            "orientation": array("d"),
            "wrench": array("d"),
        }
        """What every sample has; None for what one of them has not."""

    def add(self, passed: Passed, state: str | None) -> None:
        """Take in one more; RecordingError where it is one too many."""
        if len(self.log_ns) == MOST_SAMPLES:
            raise RecordingError(f"has a demonstration of more than {MOST_SAMPLES} samples")
        self.log_ns.append(passed.log_ns)
        self._positions.extend(passed.position)
        self._states.append(state)
        for name, numbers in self._senses.items():
            felt = getattr(passed.sample.motion, name)
            if felt is None or numbers is None:
                self._senses[name] = None
            else:
                numbers.extend(felt.tolist())

    def demonstration(self, name: str, first_ns: int) -> Demonstration:
        """Return it, with times since `first_ns`."""
        orientation, wrench = self._senses["orientation"], self._senses["wrench"]
        return Demonstration(
            name,
            np.array([(at - first_ns) / NS_PER_S for at in self.log_ns]),
            _rows(self._positions, 3),
            tuple(self._states),
            None if orientation is None else _rows(orientation, 4),
            None if wrench is None else _rows(wrench, 6),
        )


def _rows(numbers: array[float], width: int) -> NDArray[np.float64]:
    return np.array(numbers).reshape(-1, width)


def _demonstrations(
    content: RecordingContent,
    runs: Iterable[tuple[object, Sample]],
    state_at: Callable[[int], str | None],
) -> list[Demonstration]:
    """What the engaged hand did in each run of samples; None is of no run."""
    made: list[_Run] = []
    try:
        for run, own in groupby(runs, key=lambda numbered: numbered[0]):
            if run is not None:
                if len(made) == MOST_DEMONSTRATIONS:
                    raise RecordingError(f"has more than {MOST_DEMONSTRATIONS} demonstrations")
                made.append(_Run())
                for passed in way_of(sample for _, sample in own):
                    made[-1].add(passed, state_at(passed.log_ns))
    except RecordingError as error:
        raise RecordingError(f"{content.path}: {error}: train from its parts") from error
    name = content.path.name
    return [
        run.demonstration(f"{name}#{number}" if len(made) > 1 else name, content.first_ns)
        for number, run in enumerate(made, start=1)
        if len(run.log_ns) >= LEAST_SAMPLES
    ]
