"""Gathering: whatever the order of arrival, each step is released once, in order, in time."""

import weakref

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.recognition.recognizer import StepEvidence
from hmcs_task_hmm.gathering import Gathering

DEADLINE_NS = 20


def evidence(step, gestemes, ratio=0.0):
    held = sorted(gestemes)
    return StepEvidence(
        step,
        tuple(held),
        np.array(held, dtype=np.int32),
        np.full(len(held), step, dtype=np.int32),
        np.zeros(len(held)),
        np.full(len(held), ratio),
    )


def gathering(gestemes=(0, 1, 2)):
    return Gathering(gestemes, DEADLINE_NS)


def test_a_step_is_released_as_soon_as_every_gesteme_is_covered():
    g = gathering()
    g.begin(0, now_ns=0)
    assert g.add(evidence(0, {0, 1}), 0) == "taken"
    assert g.release(now_ns=1) is None
    assert g.add(evidence(0, {2}), 0) == "taken"
    released = g.release(now_ns=2)
    assert released is not None
    assert released.gestemes == (0, 1, 2)
    assert g.release(now_ns=3) is None


def test_past_the_deadline_a_step_is_released_with_what_came():
    g = gathering()
    g.begin(0, now_ns=100)
    g.add(evidence(0, {1}), 101)
    assert g.due_ns == 120
    g.caught_up(119)
    assert g.release(now_ns=500) is None
    g.caught_up(120)
    released = g.release(now_ns=500)
    assert released is not None
    assert released.gestemes == (1,)


def test_with_no_classifier_at_all_a_step_is_released_empty():
    g = gathering()
    g.begin(0, now_ns=0)
    g.caught_up(DEADLINE_NS)
    released = g.release(now_ns=DEADLINE_NS)
    assert released is not None
    assert released.gestemes == ()
    assert len(released.pair_start) == 0


def test_the_first_evidence_for_a_gesteme_wins():
    g = gathering()
    g.begin(0, now_ns=0)
    g.add(evidence(0, {0, 1}, ratio=1.0), 0)
    assert g.add(evidence(0, {0, 1}, ratio=2.0), 0) == "duplicate"
    assert g.add(evidence(0, {1, 2}, ratio=3.0), 0) == "taken"
    released = g.release(now_ns=1)
    assert released is not None
    by_gesteme = dict(zip(released.pair_gesteme, released.log_ratio, strict=True))
    assert by_gesteme == {0: 1.0, 1: 1.0, 2: 3.0}
    assert len(released.exit) == len(released.pair_start) == 3


def test_gestemes_are_in_order_whichever_classifier_was_first():
    g = gathering()
    g.begin(0, now_ns=0)
    g.add(evidence(0, {2}), 0)
    g.add(evidence(0, {0, 1}), 0)
    released = g.release(now_ns=0)
    assert released is not None
    assert released.gestemes == (0, 1, 2)


def test_evidence_that_overtakes_its_step_waits_for_it():
    g = gathering()
    assert g.add(evidence(0, {0, 1, 2}), 0) == "taken"
    assert g.release(now_ns=0) is None
    g.begin(0, now_ns=1)
    assert g.release(now_ns=1) is not None


@pytest.mark.parametrize("arrived_ns", [DEADLINE_NS, DEADLINE_NS + 1])
def test_evidence_for_a_step_released_at_its_deadline_is_late(arrived_ns):
    g = gathering()
    g.begin(0, now_ns=0)
    g.caught_up(DEADLINE_NS)
    g.release(now_ns=DEADLINE_NS)
    assert g.add(evidence(0, {0}), arrived_ns) == "late"


def test_a_deadline_that_has_passed_has_passed_whatever_older_evidence_is_handled_later():
    g = gathering()
    g.begin(0, now_ns=0)
    g.caught_up(DEADLINE_NS)
    g.add(evidence(1, {0}), DEADLINE_NS - 5)
    assert g.release(now_ns=DEADLINE_NS) is not None


def test_evidence_that_arrived_at_the_deadline_tells_that_it_has_passed():
    g = gathering()
    g.begin(0, now_ns=0)
    g.add(evidence(1, {0}), DEADLINE_NS - 1)
    assert g.release(now_ns=DEADLINE_NS) is None
    g.add(evidence(1, {1}), DEADLINE_NS)
    assert g.release(now_ns=DEADLINE_NS) is not None


def test_evidence_of_a_released_step_is_not_kept():
    g = gathering()
    held = evidence(0, {0, 1, 2})
    kept = weakref.ref(held.log_ratio)
    g.begin(0, now_ns=0)
    g.add(held, 0)
    assert g.release(now_ns=1) is not None
    del held
    assert kept() is None


@given(st.lists(st.integers(0, DEADLINE_NS - 1), min_size=1, max_size=8), st.integers(0, 10**6))
def test_evidence_that_arrived_in_time_counts_however_late_it_is_handled(delays, behind):
    g, period = gathering(), 10
    mail = []
    for t, delay in enumerate(delays):
        mail += [(t * period, "step", t), (t * period + delay, "evidence", t)]
    released = []
    for at, kind, t in sorted(mail):
        if kind == "step":
            g.begin(t, at)
        else:
            assert g.add(evidence(t, {0, 1, 2}), at) == "taken"
        while (item := g.release(mail[-1][0] + behind)) is not None:
            released.append(item)
    assert [item.step for item in released] == list(range(len(delays)))
    assert all(item.gestemes == (0, 1, 2) for item in released)


def test_the_second_of_two_classifiers_is_no_late_one_unless_the_deadline_has_passed():
    g = gathering()
    for t in range(3):
        g.begin(t, now_ns=10 * t)
        g.add(evidence(t, {0, 1, 2}), 10 * t + 1)
        assert g.release(now_ns=10 * t + 1) is not None
    assert g.add(evidence(1, {0, 1, 2}), 10 + DEADLINE_NS) == "duplicate"
    assert g.add(evidence(1, {0, 1, 2}), 11 + DEADLINE_NS) == "late"
    assert g.add(evidence(0, {0, 1, 2}), 11 + DEADLINE_NS) == "late"


def test_after_a_restart_only_later_steps_count():
    g = gathering()
    g.begin(0, now_ns=0)
    g.add(evidence(0, {0}), 0)
    g.restart(40)
    assert g.add(evidence(39, {0}), 0) == "late"
    g.begin(40, now_ns=0)
    g.add(evidence(40, {0, 1, 2}), 0)
    released = g.release(now_ns=0)
    assert released is not None
    assert released.step == 40


def test_a_restart_forgets_what_came_for_steps_of_the_same_numbers():
    g = gathering()
    g.begin(0, now_ns=0)
    g.add(evidence(0, {0, 1, 2}), 0)
    assert g.release(now_ns=0) is not None
    g.begin(40, now_ns=0)
    g.add(evidence(40, {0, 1}, ratio=1.0), 0)
    g.restart(40)
    assert g.due_ns is None
    assert g.add(evidence(0, {0}), 1) == "late"
    g.begin(40, now_ns=5)
    assert g.add(evidence(40, {0, 1, 2}, ratio=2.0), 5) == "taken"
    released = g.release(now_ns=5)
    assert released is not None
    np.testing.assert_array_equal(released.log_ratio, [2.0] * 3)


@given(st.data())
def test_every_step_is_released_once_and_in_order_whatever_comes_when(data):
    steps = data.draw(st.integers(1, 6))
    events = [("begin", t, frozenset()) for t in range(steps)]
    for t in range(steps):
        for _ in range(data.draw(st.integers(0, 3))):
            events.append(
                ("evidence", t, data.draw(st.frozensets(st.sampled_from([0, 1, 2]), min_size=1)))
            )
    events = data.draw(st.permutations(events))
    g, released, now_ns = gathering(), [], 0
    for kind, t, gestemes in events:
        now_ns += data.draw(st.integers(0, 15))
        if kind == "begin":
            g.begin(t, now_ns)
        else:
            verdict = g.add(evidence(t, gestemes), now_ns)
            assert (verdict == "taken") <= (t >= len(released))
            assert (verdict == "late") <= (t < len(released))
        while (item := g.release(now_ns)) is not None:
            released.append(item)
    g.caught_up(now_ns + DEADLINE_NS)
    while (item := g.release(now_ns + DEADLINE_NS)) is not None:
        released.append(item)
    assert [item.step for item in released] == list(range(steps))
    for item in released:
        held = item.gestemes
        assert len(set(held)) == len(held)


@pytest.mark.parametrize("now_ns", [0, 5])
def test_the_next_deadline_is_that_of_the_next_step(now_ns):
    g = gathering()
    assert g.due_ns is None
    g.begin(1, now_ns)
    assert g.due_ns is None
    g.begin(0, now_ns + 3)
    assert g.due_ns == now_ns + 3 + DEADLINE_NS
