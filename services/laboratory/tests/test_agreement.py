from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.metrics import adjusted_rand_score

from hmcs_laboratory.agreement import (
    BoundaryAgreement,
    adjusted_rand_index,
    boundaries_of,
    boundary_agreement,
    pooled_agreement,
)

LABELED_TWICE = st.integers(1, 30).flatmap(
    lambda count: st.tuples(*[st.lists(st.integers(0, 4), min_size=count, max_size=count)] * 2)
)
INDICES = st.lists(st.integers(0, 20), max_size=5)


@settings(max_examples=100)
@given(LABELED_TWICE)
def test_adjusted_rand_index_is_that_of_scikit_learn(labels):
    true, found = labels
    assert adjusted_rand_index(true, found) == pytest.approx(adjusted_rand_score(true, found))


def test_adjusted_rand_index_does_not_care_for_names():
    assert adjusted_rand_index([0, 0, 1, 2], ["b", "b", "c", "a"]) == 1.0


def test_adjusted_rand_index_of_unrelated_labels_is_zero_on_average():
    rng = np.random.default_rng(0)
    true = np.repeat(np.arange(5), 20)
    found = [adjusted_rand_index(true, rng.permutation(true)) for _ in range(200)]
    assert abs(np.mean(found)) < 3 * np.std(found) / np.sqrt(len(found))


@pytest.mark.parametrize(("true", "found"), [([], []), ([0, 1], [0]), ([[0]], [[0]])])
def test_labels_that_are_not_of_the_same_steps_are_refused(true, found):
    with pytest.raises(ValueError, match=r"expected \(T,\) twice"):
        adjusted_rand_index(true, found)


@settings(max_examples=100)
@given(INDICES, INDICES, st.integers(0, 4))
def test_as_many_boundaries_are_matched_as_any_pairing_could(true, found, tolerance):
    few, many = sorted([true, found], key=len)
    best = max(
        sum(abs(a - b) <= tolerance for a, b in zip(chosen, order, strict=True))
        for chosen in combinations(many, len(few))
        for order in permutations(few)
    )
    assert boundary_agreement(true, found, tolerance) == (best, len(found), len(true))


def test_one_found_boundary_matches_one_true_boundary_only():
    agreement = boundary_agreement([10, 12], [11], 2)
    assert agreement == (1, 1, 2)
    assert (agreement.precision, agreement.recall) == (1.0, 0.5)
    assert agreement.f_score == pytest.approx(2 / 3)


def test_nothing_to_find_and_nothing_found_is_right():
    nothing = boundary_agreement([], [], 3)
    assert (nothing.precision, nothing.recall, nothing.f_score) == (1.0, 1.0, 1.0)
    assert boundary_agreement([5], [], 3).f_score == 0.0


def test_a_tolerance_below_zero_is_refused():
    with pytest.raises(ValueError, match="expected 0 steps or more"):
        boundary_agreement([1], [1], -1)


def test_boundaries_stand_where_labels_change():
    assert boundaries_of(["a", "a", "b", "a"]).tolist() == [2, 3]
    assert boundaries_of(["a"]).tolist() == []


def test_demonstrations_add_up():
    assert pooled_agreement([BoundaryAgreement(1, 2, 3), BoundaryAgreement(2, 2, 2)]) == (3, 4, 5)
