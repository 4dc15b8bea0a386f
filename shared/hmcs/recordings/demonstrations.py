"""Recordings as demonstrations: the path of the engaged hand, with the labels it was given."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from hmcs.bus.messages import Motion
from hmcs.motion.demonstrations import Demonstration
from hmcs.recordings.labels import labels_of
from hmcs.recordings.reading import RecordingContent
from hmcs.recordings.stretches import NS_PER_S, Stretch

LEAST_SAMPLES = 2
BACK_SHARE = 0.1
"""A hand is back where it began once it is nearer than this share of how far its way reaches."""


class _Sample(NamedTuple):
    log_ns: int
    motion: Motion
    state: str | None


def demonstrations_of(content: RecordingContent) -> list[Demonstration]:
    """Return the demonstrations of a recording, their times in s since its first message.

    Where it has labels there is one for every run of labeled motion, without a stretch between;
    else there is one, without labels. Motion made with the dead-man released or the clutch pressed
    is taken out, so that the path has no jumps. Raises RecordingError as `labels_of` does.
    """
    labels = labels_of(content)
    if not labels:
        return _named(content, [_samples(content)])
    begins = [label.begin_ns for label in labels]

    def state_at(log_ns: int) -> str | None:
        index = bisect_right(begins, log_ns) - 1
        return labels[index].state if index >= 0 and log_ns < labels[index].end_ns else None

    samples = [s._replace(state=state_at(s.log_ns)) for s in _samples(content)]
    runs = [list(run) for known, run in groupby(samples, lambda s: s.state is not None) if known]
    return _named(content, runs)


def performances_of(content: RecordingContent) -> list[Demonstration]:
    """Return the demonstrations of a recording without a look at its labels.

    A new one begins where the operator let go and took hold again where the last one had begun,
    nearer to there than to where he let go. Else as `demonstrations_of`.
    """
    return _named(content, list(_performances(_samples(content))))


def whole_way(content: RecordingContent) -> Demonstration | None:
    """Return all that the engaged hand did in a recording as one demonstration without labels.

    None where it did nothing.
    """
    return _demonstration(content.path.name, _samples(content), content.first_ns)


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


def _samples(content: RecordingContent) -> list[_Sample]:
    return [_Sample(recorded.log_ns, motion, None) for recorded, _, motion in content.of(Motion)]


def _named(content: RecordingContent, runs: list[list[_Sample]]) -> list[Demonstration]:
    name = content.path.name
    made = [
        _demonstration(f"{name}#{number}" if len(runs) > 1 else name, run, content.first_ns)
        for number, run in enumerate(runs, start=1)
    ]
    return [demonstration for demonstration in made if demonstration is not None]


def _performances(samples: Sequence[_Sample]) -> Iterator[list[_Sample]]:
    run: list[_Sample] = []
    own: list[np.ndarray] = []
    """Where the hand was in it while engaged."""
    let_go = False
    for sample in samples:
        motion = sample.motion
        if not motion.dead_man:
            let_go = True
        elif not motion.clutch:
            if let_go and own and _is_back(np.array(own), motion.position):
                yield run
                run, own = [], []
            let_go = False
            own.append(motion.position)
        run.append(sample)
    yield run


def _is_back(way: np.ndarray, position: np.ndarray) -> bool:
    """Whether a hand that took hold again at a position begins its way anew."""
    from_begin_m, from_end_m = (float(np.linalg.norm(position - way[at])) for at in (0, -1))
    reach_m = float(np.linalg.norm(way - way[0], axis=1).max())
    return reach_m > 0 and from_begin_m <= max(from_end_m, BACK_SHARE * reach_m)


def _demonstration(name: str, samples: list[_Sample], first_ns: int) -> Demonstration | None:
    """What the engaged hand did in these samples; None where it did nothing."""
    kept: list[_Sample] = []
    positions: list[np.ndarray] = []
    before: Motion | None = None
    for sample in samples:
        motion = sample.motion
        engaged = motion.dead_man and not motion.clutch
        if engaged and (not kept or sample.log_ns > kept[-1].log_ns):
            last = positions[-1] if positions else motion.position
            step = motion.position - before.position if before is not None else 0.0
            positions.append(last + step if positions else motion.position)
            kept.append(sample)
        before = motion if engaged else None
    if len(kept) < LEAST_SAMPLES:
        return None
    time_s = np.array([(sample.log_ns - first_ns) / NS_PER_S for sample in kept])
    return Demonstration(
        name,
        time_s,
        np.array(positions),
        tuple(sample.state for sample in kept),
        _all([sample.motion.orientation for sample in kept]),
        _all([sample.motion.wrench for sample in kept]),
    )


def _all(values: list[np.ndarray | None]) -> np.ndarray | None:
    known = [value for value in values if value is not None]
    return np.array(known) if len(known) == len(values) else None
