"""What a model found in a recording that is shown, compared with the labels it has."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hmcs.bus.messages import Segmentation
from hmcs.recordings.stretches import LabelError, Stretch, to_ns
from hmcs_console.seeing.takes import MOST, MOST_STATES, Found, Take, states_of

MOST_SEGMENTS = 2_000


def with_found(take: Take, said: Segmentation) -> Take:
    """Return the recording with what was found in it.

    Raises LabelError where that contradicts itself, or is of no recording that can be drawn.
    """
    count = len(said.states)
    if not len(said.begin_s) == len(said.end_s) == len(said.probability) == count:
        raise LabelError(f"{said.recording}: not a begin, an end and a probability for each part")
    if count > MOST_SEGMENTS or len(set(said.states)) > MOST_STATES:
        raise LabelError(f"{said.recording}: more parts than can be drawn")
    if any(np.abs(each).max(initial=0.0) > MOST for each in (said.begin_s, said.end_s)):
        raise LabelError(f"{said.recording}: times of no recording")
    segments = tuple(
        Stretch(to_ns(begin), to_ns(end), state)
        for begin, end, state in zip(
            said.begin_s.tolist(), said.end_s.tolist(), said.states, strict=True
        )
    )
    if any(each.begin_ns >= each.end_ns for each in segments) or any(
        one.end_ns > other.begin_ns for one, other in pairwise(segments)
    ):
        raise LabelError(f"{said.recording}: parts that are not one after another")
    shares = tuple(said.probability.clip(0.0, 1.0).tolist())
    return take._replace(found=Found(said.model, segments, shares), said="")


def colored_states(take: Take, states: Sequence[str]) -> tuple[str, ...]:
    """Return the states by whose places labels and what was found are colored."""
    named = states_of(take, states)
    others = () if take.found is None else (each.state for each in take.found.segments)
    bare = (state.partition("/")[0] for state in others)
    return (*named, *sorted({state for state in bare if state} - set(named)))


def agreement(take: Take) -> float | None:
    """Return the share of the labeled time in which the same state was found.

    None where nothing was found, or nothing is labeled.
    """
    labeled_ns = sum(label.end_ns - label.begin_ns for label in take.labels)
    if take.found is None or not labeled_ns:
        return None
    same_ns = sum(
        max(0, min(label.end_ns, part.end_ns) - max(label.begin_ns, part.begin_ns))
        for label in take.labels
        for part in take.found.segments
        if part.state.partition("/")[0] == label.state.partition("/")[0]
    )
    return same_ns / labeled_ns
