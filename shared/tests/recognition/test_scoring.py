from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.recognition.scoring import NONE, changes, midway_labels, pooled, score

A, B, C = 0, 1, 2
TRUE = [A] * 6 + [B] * 4 + [C] * 4

states = st.lists(st.sampled_from([NONE, A, B, C]), min_size=1, max_size=40)


def test_perfect_recognition_is_right_without_delay_or_false_switch() -> None:
    scores = score(TRUE, TRUE)
    assert scores.accuracy == 1.0
    assert scores.switch_delays.tolist() == [0, 0]
    assert (scores.missing_steps, scores.missed_switches, scores.false_switches) == (0, 0, 0)


def test_late_switch_is_delay_and_not_false() -> None:
    scores = score(TRUE, [A] * 8 + [B] * 2 + [C] * 4)
    assert scores.switch_delays.tolist() == [2, 0]
    assert scores.false_switches == 0
    assert scores.accuracy == pytest.approx(12 / 14)


def test_early_switch_is_a_negative_delay() -> None:
    scores = score(TRUE, [A] * 5 + [B] * 5 + [C] * 4)
    assert scores.switch_delays.tolist() == [-1, 0]
    assert scores.false_switches == 0


def test_switch_believed_before_half_of_the_segment_is_false() -> None:
    scores = score(TRUE, [A, B, A, A, A, A, *TRUE[6:]])
    assert scores.switch_delays.tolist() == [0, 0]
    assert scores.false_switches == 2


def test_blip_before_the_switch_counts_as_it_and_the_way_back_and_again_as_false() -> None:
    scores = score(TRUE, [A, A, A, A, B, A, *TRUE[6:]])
    assert scores.switch_delays.tolist() == [-2, 0]
    assert scores.false_switches == 2


def test_switch_never_believed_counts_with_the_length_of_its_segment() -> None:
    scores = score(TRUE, [A] * 10 + [C] * 4)
    assert scores.switch_delays.tolist() == [4, 0]
    assert (scores.missed_switches, scores.false_switches) == (1, 0)


def test_missing_belief_is_wrong_but_no_switch() -> None:
    believed = list(TRUE)
    believed[2] = believed[6] = NONE
    scores = score(TRUE, believed)
    assert scores.missing_steps == 2
    assert scores.right_steps == 12
    assert scores.switch_delays.tolist() == [1, 0]
    assert scores.false_switches == 0


def test_unlabeled_steps_are_not_judged() -> None:
    scores = score([A, A, NONE, NONE, B, B], [A, A, C, A, B, B])
    assert scores.accuracy == 1.0
    assert scores.switch_delays.tolist() == [0]
    assert scores.false_switches == 0


def test_without_labels_there_is_no_accuracy() -> None:
    scores = score([NONE, NONE], [A, B])
    assert np.isnan(scores.accuracy)
    assert np.isnan(scores.false_switches_per_1000_steps)
    assert np.isnan(scores.switch_delay(50))


def test_pooled_scores_add_up_without_a_switch_between_performances() -> None:
    first, second = score(TRUE, TRUE), score([C, C, A, A], [C, C, C, A])
    both = pooled([first, second])
    assert (both.steps, both.right_steps, both.labeled_steps) == (18, 17, 18)
    assert both.switch_delays.tolist() == [0, 0, 1]
    assert both.switch_delay(100) == 1
    assert pooled([]).steps == 0


def test_step_belongs_to_the_state_most_of_it_was_made_in() -> None:
    labels = [A] * 10 + [B] * 10
    assert midway_labels(labels, [0, 4, 6, 12], [4, 14, 16, 18]).tolist() == [A, A, B, B]


def test_shapes_must_agree() -> None:
    with pytest.raises(ValueError, match="expected"):
        score([A, B], [A])


@given(states, st.data())
def test_every_change_is_either_a_followed_switch_or_false(
    true: list[int], data: st.DataObject
) -> None:
    believed = data.draw(
        st.lists(st.sampled_from([A, B, C]), min_size=len(true), max_size=len(true))
    )
    labeled = [x if x != NONE else A for x in true]
    scores = score(labeled, believed)
    switches = len(changes(labeled))
    assert len(scores.switch_delays) == switches
    assert scores.false_switches <= len(changes(believed))
    assert scores.false_switches >= len(changes(believed)) - (switches - scores.missed_switches)
    assert scores.right_steps == sum(t == b for t, b in zip(labeled, believed, strict=True))


@given(states)
def test_truth_scores_itself_perfectly(true: list[int]) -> None:
    labeled = [x if x != NONE else B for x in true]
    scores = score(labeled, labeled)
    assert scores.accuracy == 1.0
    assert scores.false_switches == scores.missed_switches == 0
    # A state that returns soon may be believed again before its own switch only in its own segment.
    assert (scores.switch_delays == 0).all()
