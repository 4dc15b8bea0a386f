"""The segment filter against enumeration of every segmentation of short sequences."""

from collections import defaultdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.recognition.recognizer import StepEvidence
from hmcs.recognition.segment_filter.filter import FilterSettings, SegmentFilter, TaskChain
from support.segmentations import (
    SETTINGS,
    UNKNOWN,
    enumerate_segmentations,
    random_chain,
    random_evidence,
)


@given(
    seed=st.integers(0, 10_000),
    steps=st.integers(1, 5),
    shared=st.booleans(),
    hole=st.booleans(),
)
@settings(max_examples=30)
def test_the_filter_is_exact_over_every_segmentation(seed, steps, shared, hole):
    rng = np.random.default_rng(seed)
    chain = random_chain(rng, shared=shared)
    absent = {(steps - 1, 1)} if hole and steps > 1 else set()
    evidence = random_evidence(rng, steps, absent=absent)
    task_filter = SegmentFilter(chain, SETTINGS)
    log_total = 0.0
    for t in range(steps):
        belief = task_filter.step(evidence[t])
        histories = list(enumerate_segmentations(chain, evidence[: t + 1]))
        total = sum(weight for _, weight in histories)
        states = np.zeros(2)
        unknown = 0.0
        for history, weight in histories:
            if history[-1] == UNKNOWN:
                unknown += weight / total
            else:
                states[chain.slot_state[history[-1][0]]] += weight / total
        np.testing.assert_allclose(belief.states, states, atol=1e-12)
        assert belief.unknown == pytest.approx(unknown, abs=1e-12)
        assert belief.log_likelihood == pytest.approx(np.log(total) - log_total, abs=1e-10)
        log_total = np.log(total)


def test_the_likely_segment_start_is_that_of_the_heaviest_hypothesis():
    rng = np.random.default_rng(5)
    chain = random_chain(rng, shared=True)
    evidence = random_evidence(rng, 4)
    task_filter = SegmentFilter(chain, SETTINGS)
    for item in evidence:
        belief = task_filter.step(item)
    weights = defaultdict(float)
    for history, weight in enumerate_segmentations(chain, evidence):
        if history[-1] != UNKNOWN and chain.slot_state[history[-1][0]] == belief.states.argmax():
            weights[history[-1]] += weight
    slot, start = max(weights, key=weights.__getitem__)
    assert belief.segment_start == start
    assert belief.gesteme == chain.slot_gesteme[slot]


@given(seed=st.integers(0, 10_000))
@settings(max_examples=20)
def test_beliefs_are_finite_and_sum_to_one_whatever_the_evidence(seed):
    rng = np.random.default_rng(seed)
    chain = random_chain(rng)
    task_filter = SegmentFilter(chain, FilterSettings())
    for t in range(30):
        living = [
            (g, s) for s in range(max(0, t - 9), t + 1) for g in range(2) if rng.random() < 0.7
        ]
        evidence = StepEvidence(
            t,
            (0, 1),
            np.array([g for g, _ in living], dtype=np.int32),
            np.array([s for _, s in living], dtype=np.int32),
            rng.choice([0.0, 0.3, 1.0], size=len(living)),
            rng.choice([-40.0, -1.0, 0.0, 5.0, 40.0], size=len(living)),
        )
        belief = task_filter.step(evidence)
        assert np.isfinite(belief.states).all()
        assert np.isfinite(belief.log_likelihood)
        assert belief.states.sum() + belief.unknown == pytest.approx(1.0)


def test_a_gesteme_without_a_classifier_is_named_and_costs_nothing():
    chain = random_chain(np.random.default_rng(0), shared=False)
    task_filter = SegmentFilter(chain, SETTINGS)
    none = np.zeros(0, dtype=np.int32)
    belief = task_filter.step(StepEvidence(0, (), none, none, np.zeros(0), np.zeros(0)))
    assert belief.missing == (0, 1)
    assert belief.log_likelihood == pytest.approx(0.0)
    np.testing.assert_allclose(belief.states, chain.initial * (1 - SETTINGS.unknown_after))


def test_dropping_what_is_negligible_changes_the_belief_by_less_than_it_drops():
    rng = np.random.default_rng(9)
    chain = random_chain(rng)
    evidence = random_evidence(rng, 40)
    exact, pruned = (
        SegmentFilter(chain, SETTINGS),
        SegmentFilter(chain, SETTINGS._replace(drop_below=1e-6)),
    )
    for item in evidence:
        full, small = exact.step(item), pruned.step(item)
        np.testing.assert_allclose(small.states, full.states, atol=1e-3)


def pairs(step, given, gestemes=(0, 1)):
    """Evidence of pairs (gesteme, start): (exit, log ratio)."""
    return StepEvidence(
        step,
        gestemes,
        np.array([g for g, _ in given], dtype=np.int32),
        np.array([s for _, s in given], dtype=np.int32),
        np.array([exits for exits, _ in given.values()]),
        np.array([ratio for _, ratio in given.values()]),
    )


def test_a_missing_gesteme_costs_nothing_however_long_ago_its_segment_began():
    chain = random_chain(np.random.default_rng(0), shared=False)
    task_filter = SegmentFilter(chain, SETTINGS)
    for t in range(6):
        task_filter.step(pairs(t, {(0, 0): (0.0, 4.0 if t else 2.0), (1, 0): (0.0, -9.0)}))
    # Nothing is heard of gesteme 0, and what is heard of the other began just now.
    belief = task_filter.step(pairs(6, {(1, 6): (0.0, 0.0)}, gestemes=(1,)))
    assert belief.missing == (0,)
    assert belief.states[0] > 0.9
    assert belief.segment_start == 0


def test_what_is_dropped_does_not_come_back():
    chain = random_chain(np.random.default_rng(0), shared=False)
    strict = SETTINGS._replace(drop_below=1e-3, any_state=0.0, again=0.0, recover=0.0)
    believed = {}
    for name, dropping in (("dropped", strict), ("kept", strict._replace(drop_below=0.0))):
        task_filter = SegmentFilter(chain, dropping)
        belief = task_filter.step(pairs(0, {(0, 0): (0.0, 12.0), (1, 0): (0.0, 0.0)}))
        assert belief.states.sum() + belief.unknown == pytest.approx(1.0, abs=1e-12)
        # What was all but impossible would be nearly certain now.
        belief = task_filter.step(pairs(1, {(0, 0): (0.0, 0.0), (1, 0): (0.0, 40.0)}))
        believed[name] = belief.states[1]
    assert believed["kept"] > 0.99
    assert believed["dropped"] == 0.0


@pytest.mark.parametrize("others", [{(0, 1): (0.0, 0.0)}, {(1, 0): (0.0, 0.0)}])
def test_a_start_that_a_classifier_names_no_more_is_impossible(others):
    chain = random_chain(np.random.default_rng(0), shared=False)
    task_filter = SegmentFilter(chain, SETTINGS._replace(drop_below=1e-6))
    # Step by step it becomes all but certain that gesteme 0 is going on since the first step.
    belief = task_filter.step(pairs(0, {(0, 0): (0.0, 9.0), (1, 0): (0.0, 0.0)}))
    assert belief.states[0] > 0.99
    belief = task_filter.step(pairs(1, others))
    assert belief.states[0] < 0.7
    assert (belief.gesteme, belief.segment_start) != (0, 0)


def test_where_nothing_of_the_task_is_left_a_segment_may_only_begin_now():
    chain = random_chain(np.random.default_rng(0), shared=False)
    task_filter = SegmentFilter(chain, SETTINGS)
    task_filter.step(pairs(0, {(0, 0): (0.0, 0.0), (1, 0): (0.0, 0.0)}))
    belief = task_filter.step(pairs(1, {(0, 0): (0.0, -np.inf)}))
    assert belief.unknown == 1.0
    assert belief.segment_start == 1


def test_the_likely_segment_is_one_of_the_likely_state():
    # State 0 has two gestemes of three tenths each, state 1 one of four tenths.
    chain = TaskChain(
        np.array([0.6, 0.4]),
        np.eye(2),
        np.array([0, 0, 1], dtype=np.int32),
        np.array([0, 1, 2], dtype=np.int32),
        np.array([0.5, 0.5, 1.0]),
    )
    begun = {(g, 0): (0.0, 0.0) for g in range(3)}
    belief = SegmentFilter(chain, SETTINGS).step(pairs(0, begun, gestemes=(0, 1, 2)))
    assert belief.states.argmax() == 0
    assert belief.gesteme in (0, 1)


def test_evidence_however_strong_leaves_numbers():
    chain = random_chain(np.random.default_rng(0), shared=False)
    task_filter = SegmentFilter(chain, SETTINGS)
    belief = task_filter.step(pairs(0, {(0, 0): (0.0, 2_000.0), (1, 0): (0.0, -2_000.0)}))
    assert belief.states[0] == pytest.approx(1.0)
    begun = chain.initial[0] * (1 - SETTINGS.unknown_after)
    assert belief.log_likelihood == pytest.approx(2_000.0 + np.log(begun), abs=1e-9)


EXTREME = st.sampled_from([-np.inf, -1e9, -4_000.0, -1.0, 0.0, 1.0, 4_000.0, 1e9])


@given(
    ratios=st.lists(st.tuples(EXTREME, EXTREME), min_size=1, max_size=6),
    exits=st.sampled_from([0.0, 0.5, 1.0]),
    abandon=st.sampled_from([0.0, 1e-4]),
)
def test_evidence_of_any_size_leaves_a_belief_that_sums_to_one(ratios, exits, abandon):
    # Only the first state may begin, so the evidence of the second is of what is impossible.
    chain = TaskChain(
        np.array([1.0, 0.0]), np.eye(2), *2 * (np.array([0, 1], dtype=np.int32),), np.ones(2)
    )
    task_filter = SegmentFilter(chain, SETTINGS._replace(abandon=abandon))
    for step, (first, second) in enumerate(ratios):
        given_pairs = {
            (g, start): (exits if start < step else 0.0, ratio)
            for g, ratio in enumerate((first, second))
            for start in range(step + 1)
            if np.isfinite(ratio)
        }
        belief = task_filter.step(pairs(step, given_pairs))
        assert belief.states.sum() + belief.unknown == pytest.approx(1.0)
        assert np.isfinite(belief.log_likelihood)


def test_evidence_for_what_is_impossible_changes_nothing():
    chain = random_chain(np.random.default_rng(0), shared=False)
    only = chain._replace(initial=np.array([1.0, 0.0]))
    beliefs = []
    for ratio in (0.0, 5_000.0):
        task_filter = SegmentFilter(only, SETTINGS)
        beliefs.append(task_filter.step(pairs(0, {(0, 0): (0.0, 1.0), (1, 0): (0.0, ratio)})))
    np.testing.assert_array_equal(beliefs[1].states, beliefs[0].states)
    assert beliefs[1].unknown == beliefs[0].unknown < 0.5


def test_a_filter_that_was_reset_begins_as_a_new_one():
    rng = np.random.default_rng(3)
    chain = random_chain(rng)
    used, new = SegmentFilter(chain, SETTINGS), SegmentFilter(chain, SETTINGS)
    for item in random_evidence(rng, 4):
        used.step(item)
    used.reset()
    for item in random_evidence(rng, 4):
        one, other = used.step(item), new.step(item)
        np.testing.assert_array_equal(one.states, other.states)
        assert one.unknown == other.unknown
