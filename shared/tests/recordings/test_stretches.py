"""Labels that are set and taken away: never one over another, whatever is done."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.recordings.stretches import (
    LabelError,
    Stretch,
    check_within,
    cleared,
    of_seconds,
    relabeled,
)

LENGTH = 40
times = st.integers(0, LENGTH)
states = st.sampled_from(["take", "bring", "set"])


@st.composite
def edits(draw: st.DrawFn) -> list[tuple[int, int, str]]:
    """Stretches with a state to be set, or none to be cleared."""
    pairs = st.tuples(times, times).filter(lambda pair: pair[0] < pair[1])
    one = st.builds(lambda pair, state: (*pair, state), pairs, st.just("") | states)
    return draw(st.lists(one, max_size=12))


def done(steps: list[tuple[int, int, str]]) -> tuple[tuple[Stretch, ...], np.ndarray]:
    """The labels after all edits, and what each moment must say."""
    labels: tuple[Stretch, ...] = ()
    moments = np.full(LENGTH, "", dtype=object)
    for begin, end, state in steps:
        moments[begin:end] = state
        labels = (
            relabeled(labels, Stretch(begin, end, state)) if state else cleared(labels, begin, end)
        )
    return labels, moments


@given(edits())
def test_every_moment_says_what_was_said_of_it_last(steps: list[tuple[int, int, str]]) -> None:
    labels, moments = done(steps)
    said = np.full(LENGTH, "", dtype=object)
    for label in labels:
        said[label.begin_ns : label.end_ns] = label.state
    assert said.tolist() == moments.tolist()


@given(edits())
def test_labels_stand_in_order_and_never_overlap(steps: list[tuple[int, int, str]]) -> None:
    labels, _ = done(steps)
    assert all(label.begin_ns < label.end_ns for label in labels)
    assert all(one.end_ns <= other.begin_ns for one, other in pairwise(labels))


def test_a_label_beside_one_of_the_same_state_becomes_one_with_it() -> None:
    labels = relabeled([Stretch(0, 5, "take"), Stretch(9, 12, "take")], Stretch(5, 9, "take"))
    assert labels == (Stretch(0, 12, "take"),)


def test_what_a_label_is_set_over_is_cut() -> None:
    labels = relabeled([Stretch(0, 10, "take")], Stretch(4, 6, "bring"))
    assert labels == (Stretch(0, 4, "take"), Stretch(4, 6, "bring"), Stretch(6, 10, "take"))


@pytest.mark.parametrize(
    ("begin_s", "end_s", "names", "says"),
    [
        ([0.0], [1.0], [], "1 labels begin, 1 end, and 0 say"),
        ([0.0, 0.5], [1.0, 2.0], ["a", "b"], "'b' from 0.500 s to 2.000 s begins before 'a'"),
        ([2.0, 0.0], [3.0, 1.0], ["a", "b"], "'b' from 0.000 s to 1.000 s begins before 'a'"),
        ([1.0], [1.0], ["a"], "let it begin before it ends"),
        ([0.0], [float("inf")], ["a"], "give finite seconds"),
        ([0.0], [1.0], [" "], "give it the name of a state"),
        ([0.0], [1.0], ["a\nb"], "give it the name of a state"),
    ],
)
def test_labels_that_cannot_be_are_refused(
    begin_s: list[float], end_s: list[float], names: list[str], says: str
) -> None:
    with pytest.raises(LabelError, match=says):
        of_seconds(begin_s, end_s, names)


@pytest.mark.parametrize(("begin_s", "end_s"), [(-0.1, 1.0), (9.0, 10.1)])
def test_labels_outside_of_a_recording_are_refused(begin_s: float, end_s: float) -> None:
    (label,) = of_seconds([begin_s], [end_s], ["a"])
    with pytest.raises(LabelError, match=r"outside of the recording, which lasts 10\.000 s"):
        check_within([label], 0, 10_000_000_000)


def test_a_label_up_to_the_last_message_is_within() -> None:
    check_within([Stretch(0, 10_000_000_001, "a")], 0, 10_000_000_000)
