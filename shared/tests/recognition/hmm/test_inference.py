"""Evaluation and decoding against enumeration of every state path."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.errors import UserError
from hmcs.recognition.hmm.inference import (
    ImpossibleSequenceError,
    forward,
    log_filtered,
    log_likelihood,
    shortest_path,
    smooth,
)
from hmcs.recognition.hmm.log_transitions import LogTransitions

seeds = st.integers(0, 10_000)
tiny = {"seed": seeds, "states": st.integers(1, 3), "steps": st.integers(1, 5)}


def random_log_emission(seed, steps, states):
    return np.random.default_rng([seed, 2]).normal(-1.0, 2.0, size=(steps, states))


@given(**tiny, zeros=st.booleans())
@settings(max_examples=25)
def test_evaluation_is_the_sum_over_every_state_path(
    random_chain, every_path, seed, states, steps, zeros
):
    chain = random_chain(seed, states, zeros)
    emission = random_log_emission(seed, steps, states)
    total = sum(p for _, p in every_path(*chain, emission))
    assert log_likelihood(*chain, emission) == pytest.approx(np.log(total))


@given(**tiny, zeros=st.booleans())
@settings(max_examples=25)
def test_the_filter_gives_each_state_the_share_of_the_paths_that_lead_there(
    random_chain, every_path, seed, states, steps, zeros
):
    initial, transition = random_chain(seed, states, zeros)
    emission = random_log_emission(seed, steps, states)
    passed = log_filtered(initial, LogTransitions(transition), emission)
    for t in range(steps):
        joint = np.zeros(states)
        for path, p in every_path(initial, transition, emission[: t + 1]):
            joint[path[-1]] += p
        np.testing.assert_allclose(np.exp(passed.log_states[t]), joint / joint.sum(), atol=1e-12)
        assert passed.log_scales[: t + 1].sum() == pytest.approx(np.log(joint.sum()))


@given(**tiny, zeros=st.booleans())
@settings(max_examples=25)
def test_decoding_finds_the_cheapest_of_all_paths(
    random_chain, every_path, seed, states, steps, zeros
):
    chain = random_chain(seed, states, zeros)
    emission = random_log_emission(seed, steps, states)
    best_path, best = max(every_path(*chain, emission), key=lambda item: item[1])
    decoded = shortest_path(*chain, emission)
    assert tuple(decoded.path) == best_path
    assert decoded.cost == pytest.approx(-np.log(best))
    assert decoded.cost == decoded.costs[-1].min()


@given(**tiny)
@settings(max_examples=25)
def test_costs_and_predecessors_are_those_of_the_cheapest_path_to_each_state(
    random_chain, every_path, seed, states, steps
):
    chain = random_chain(seed, states)
    emission = random_log_emission(seed, steps, states)
    decoded = shortest_path(*chain, emission)
    assert (decoded.predecessors[0] == 0).all()
    for t in range(steps):
        for state in range(states):
            path, best = max(
                ((p, w) for p, w in every_path(*chain, emission[: t + 1]) if p[-1] == state),
                key=lambda item: item[1],
            )
            assert decoded.costs[t, state] == pytest.approx(-np.log(best))
            if t:
                assert decoded.predecessors[t, state] == path[-2]


@given(**tiny, zeros=st.booleans())
@settings(max_examples=25)
def test_posteriors_are_shares_of_every_state_path(
    random_chain, every_path, seed, states, steps, zeros
):
    chain = random_chain(seed, states, zeros)
    emission = random_log_emission(seed, steps, states)
    paths = list(every_path(*chain, emission))
    total = sum(p for _, p in paths)
    expected = np.zeros((steps, states))
    moved = np.zeros((states, states))
    for hidden, p in paths:
        for t, state in enumerate(hidden):
            expected[t, state] += p / total
            if t:
                moved[hidden[t - 1], state] += p / total
    smoothed = smooth(*chain, emission)
    np.testing.assert_allclose(smoothed.states, expected, atol=1e-12)
    np.testing.assert_allclose(smoothed.transitions, moved, atol=1e-12)
    np.testing.assert_allclose(smoothed.transitions.sum(axis=1), expected[:-1].sum(axis=0))


def test_states_that_cannot_be_reached_tell_nothing_however_well_they_explain():
    transition = np.array([[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.0, 0.0, 1.0]])
    initial = np.array([1.0, 0.0, 0.0])
    emission = np.array([[-2000.0, -900.0, 0.0], [-3000.0, -2500.0, 0.0]])
    smoothed = smooth(initial, transition, emission)
    assert smoothed.log_likelihood == pytest.approx(-4500.0 + np.log(0.5), abs=1e-9)
    np.testing.assert_allclose(smoothed.states, [[1, 0, 0], [0, 1, 0]], atol=1e-12)


def test_alpha_is_the_joint_probability_of_observations_and_state(random_chain, every_path):
    chain = random_chain(3, 2)
    emission = random_log_emission(4, 3, 2)
    joint = np.zeros(2)
    for path, p in every_path(*chain, emission):
        joint[path[-1]] += p
    np.testing.assert_allclose(np.exp(forward(*chain, emission)[-1]), joint)


INFERENCES = [smooth, forward, shortest_path]


@pytest.mark.parametrize("infer", INFERENCES)
def test_an_observation_that_no_state_explains_is_named(infer):
    emission = np.zeros((4, 2))
    emission[2] = -np.inf
    with pytest.raises(ImpossibleSequenceError, match=r"observation 2 on; no state") as raised:
        infer(np.array([0.5, 0.5]), np.full((2, 2), 0.5), emission)
    assert raised.value.step == 2
    assert isinstance(raised.value, UserError)


@pytest.mark.parametrize("infer", INFERENCES)
def test_an_observation_whose_states_cannot_be_reached_is_named(infer):
    emission = np.zeros((4, 3))
    emission[1:, :2] = -np.inf
    transition = np.array([[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.0, 0.0, 1.0]])
    with pytest.raises(ImpossibleSequenceError, match=r"observation 1 on; states .* \(2\)"):
        infer(np.array([1.0, 0.0, 0.0]), transition, emission)


def test_an_impossible_sequence_has_probability_zero():
    emission = np.zeros((3, 2))
    emission[1] = -np.inf
    chain = np.array([0.5, 0.5]), np.full((2, 2), 0.5)
    assert log_likelihood(*chain, emission) == -np.inf
