"""Observable Markov models against enumeration of every state sequence and against counting."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs_baselines.hmm.markov import (
    MarkovModelError,
    enumeration_operations,
    expanded,
    forward_operations,
    history_sequence,
    history_topology,
    learned,
    log_probability,
    markov_model,
    mean_stay_steps,
    predict,
    sample,
    stationary,
)


def random_model(seed, states):
    rng = np.random.default_rng(seed)
    return markov_model(rng.dirichlet(np.ones(states)), rng.dirichlet(np.ones(states), size=states))


@given(seed=st.integers(0, 10_000), states=st.integers(1, 4), steps=st.integers(1, 5))
@settings(max_examples=20)
def test_prediction_and_total_probability_equal_the_sum_over_every_sequence(seed, states, steps):
    model = random_model(seed, states)
    ends = np.zeros(states)
    for path in product(range(states), repeat=steps):
        ends[path[-1]] += np.exp(log_probability(model, path))
    assert ends.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(predict(model, model.initial, steps - 1), ends, atol=1e-12)


def test_an_impossible_sequence_has_probability_zero():
    model = markov_model([1, 0], [[0.5, 0.5], [0, 1]])
    assert log_probability(model, [0, 1, 0]) == -np.inf
    assert log_probability(model, [1]) == -np.inf


@given(seed=st.integers(0, 10_000), states=st.integers(1, 6))
@settings(max_examples=20)
def test_the_stationary_distribution_is_what_far_prediction_comes_to(seed, states):
    model = random_model(seed, states)
    settled = stationary(model)
    np.testing.assert_allclose(settled @ model.transition, settled, atol=1e-12)
    np.testing.assert_allclose(predict(model, model.initial, 5000), settled, atol=1e-8)


def test_a_periodic_chain_has_a_stationary_distribution_and_transient_states_none_of_it():
    model = markov_model([1, 0, 0], [[0.5, 0.5, 0], [0, 0, 1], [0, 1, 0]])
    np.testing.assert_allclose(stationary(model), [0, 0.5, 0.5], atol=1e-15)


def test_two_sets_that_are_never_left_have_no_single_stationary_distribution():
    model = markov_model([1, 0, 0], [[0.5, 0.25, 0.25], [0, 1, 0], [0, 0, 1]])
    with pytest.raises(MarkovModelError, match=r"\[1\], \[2\]"):
        stationary(model)


def test_mean_stay_is_the_mean_of_sampled_stays():
    model = markov_model([1, 0], [[0.8, 0.2], [0.5, 0.5]])
    path = sample(model, 40_000, np.random.default_rng(0))
    firsts = np.flatnonzero(np.diff(path, prepend=-1))
    lengths = np.diff(firsts, append=len(path))
    means = [lengths[path[firsts] == state].mean() for state in range(2)]
    np.testing.assert_allclose(mean_stay_steps(model), [5.0, 2.0])
    np.testing.assert_allclose(means, [5.0, 2.0], rtol=0.03)
    assert mean_stay_steps(markov_model([1], [[1]]))[0] == np.inf


def test_learning_from_sampled_sequences_finds_the_model_again():
    model = random_model(3, 3)
    rng = np.random.default_rng(4)
    again = learned([sample(model, 60, rng) for _ in range(1000)], 3)
    np.testing.assert_allclose(again.transition, model.transition, atol=0.01)
    np.testing.assert_allclose(again.initial, model.initial, atol=0.05)


def test_learning_counts_and_no_other_model_is_more_likely():
    sequences = [[0, 0, 1, 0], [1, 1, 0]]
    model = learned(sequences, 2)
    np.testing.assert_allclose(model.initial, [0.5, 0.5])
    np.testing.assert_allclose(model.transition, [[1 / 2, 1 / 2], [2 / 3, 1 / 3]])
    best = sum(log_probability(model, s) for s in sequences)
    for seed in range(20):
        assert sum(log_probability(random_model(seed, 2), s) for s in sequences) < best


def test_what_the_topology_rules_out_stays_zero_whatever_the_pseudo_count():
    allowed = np.triu(np.ones((3, 3)))
    model = learned([[0, 1, 2, 2]], 3, pseudo_count=0.5, allowed=allowed)
    assert (model.transition[allowed == 0] == 0).all()
    assert (model.transition[allowed == 1] > 0).all()
    with pytest.raises(MarkovModelError, match="sequence 1 goes from state 2 to 1 at step 2"):
        learned([[0, 1, 2], [0, 2, 1]], 3, allowed=allowed)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_model_of_higher_order_equals_its_expansion(order):
    rng = np.random.default_rng(order)
    table = rng.dirichlet(np.ones(3), size=(3,) * order)
    start = rng.dirichlet(np.ones(3**order)).reshape((3,) * order)
    chain = expanded(start, table)
    for _ in range(20):
        path = rng.integers(3, size=order + 4)
        expected = start[tuple(path[:order])]
        for t in range(order, len(path)):
            expected *= table[tuple(path[t - order : t + 1])]
        passed = history_sequence(path, 3, order)
        assert log_probability(chain.model, passed) == pytest.approx(np.log(expected))
        np.testing.assert_array_equal(chain.histories[passed][:, -1], path[order - 1 :])
    assert (chain.model.transition[~history_topology(3, order)] == 0).all()


def test_a_model_of_second_order_is_learned_through_its_histories():
    rng = np.random.default_rng(7)
    table = rng.dirichlet(np.ones(2), size=(2, 2))
    chain = expanded(np.full((2, 2), 0.25), table)
    drawn = chain.histories[sample(chain.model, 40_000, rng)][:, -1]
    again = learned([history_sequence(drawn, 2, 2)], 4, allowed=history_topology(2, 2))
    np.testing.assert_allclose(again.transition, chain.model.transition, atol=0.02)


def test_enumeration_counts_two_operations_a_step_of_every_sequence():
    for states, steps in product(range(1, 4), range(1, 6)):
        sequences = list(product(range(states), repeat=steps))
        assert enumeration_operations(states, steps) == 2 * sum(map(len, sequences))


def test_the_forward_recursion_costs_one_operation_for_every_transition_of_every_step():
    assert forward_operations(3, 7) == 7 * random_model(0, 3).transition.size


@pytest.mark.parametrize(
    ("initial", "transition", "message"),
    [
        ([1, 0], [[0.5, 0.4], [0, 1]], "row 0 of transition"),
        ([1, 0], [[0.5, 0.5], [-0.5, 1.5]], "row 1 of transition"),
        ([1, 0], [[0.5, 0.5], [np.nan, 1]], "row 1 of transition"),
        ([1, 0.1], [[0.5, 0.5], [0, 1]], "row 0 of initial"),
        ([1, 0, 0], [[0.5, 0.5], [0, 1]], "initial has shape"),
        ([1], [[0.5, 0.5]], "square"),
        ([], np.empty((0, 0)), "not empty"),
    ],
)
def test_probabilities_that_make_no_model_are_refused(initial, transition, message):
    with pytest.raises(MarkovModelError, match=message):
        markov_model(initial, transition)


@pytest.mark.parametrize(
    ("states", "message"),
    [
        ([], "one or more"),
        ([[0, 1]], "one or more"),
        ([0.0, 1.0], "type float64"),
        ([0, 1, 2], "step 2 of a state sequence is 2"),
        ([0, -1], "step 1 of a state sequence is -1"),
    ],
)
def test_states_the_model_does_not_have_are_refused(states, message):
    with pytest.raises(MarkovModelError, match=message):
        log_probability(random_model(0, 2), states)


def test_every_function_refuses_what_it_cannot_work_on():
    model = random_model(0, 2)
    with pytest.raises(MarkovModelError, match="distribution"):
        predict(model, [0.5, 0.6], 1)
    with pytest.raises(MarkovModelError, match="-1 steps"):
        predict(model, [0.5, 0.5], -1)
    with pytest.raises(MarkovModelError, match="0 states"):
        sample(model, 0, np.random.default_rng(0))
    with pytest.raises(MarkovModelError, match="no state sequence"):
        learned([], 2)
    with pytest.raises(MarkovModelError, match="follow state 1"):
        learned([[0, 0, 1]], 2)
    with pytest.raises(MarkovModelError, match="allowed has shape"):
        learned([[0, 1]], 2, allowed=np.ones((3, 3)))
    with pytest.raises(MarkovModelError, match="no history of 3"):
        history_sequence([0, 1], 2, 3)
    with pytest.raises(MarkovModelError, match="order K"):
        expanded([0.5, 0.5], np.full((2, 2, 2), 0.5))
