"""Recordings as demonstrations: the path of the engaged hand, with the labels it was given."""

from __future__ import annotations

from bisect import bisect_right
from itertools import groupby
from typing import NamedTuple

import numpy as np

from hmcs.bus.messages import Motion
from hmcs.motion.demonstrations import Demonstration
from hmcs.recordings.labels import labels_of
from hmcs.recordings.reading import RecordingContent

LEAST_SAMPLES = 2


class _Sample(NamedTuple):
    log_ns: int
    motion: Motion
    state: str | None


def demonstrations_of(content: RecordingContent) -> list[Demonstration]:
    """Return the demonstrations of a recording.

    Where it has labels there is one for every run of labeled motion, without a stretch between;
    else there is one, without labels. Motion made with the dead-man released or the clutch pressed
    is taken out, so that the path has no jumps. Raises RecordingError as `labels_of` does.
    """
    labels = labels_of(content)
    begins = [label.begin_ns for label in labels]

    def state_at(log_ns: int) -> str | None:
        index = bisect_right(begins, log_ns) - 1
        return labels[index].state if index >= 0 and log_ns < labels[index].end_ns else None

    samples = [
        _Sample(recorded.log_ns, motion, state_at(recorded.log_ns))
        for recorded, _, motion in content.of(Motion)
    ]
    name = content.path.name
    if not labels:
        whole = _demonstration(name, samples)
        return [] if whole is None else [whole]
    runs = [list(run) for known, run in groupby(samples, lambda s: s.state is not None) if known]
    made = [
        _demonstration(f"{name}#{number}" if len(runs) > 1 else name, run)
        for number, run in enumerate(runs, start=1)
    ]
    return [demonstration for demonstration in made if demonstration is not None]


def _demonstration(name: str, samples: list[_Sample]) -> Demonstration | None:
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
    time_s = np.array([(sample.log_ns - kept[0].log_ns) / 1e9 for sample in kept])
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
