"""The bank of online filters against the forward algorithm of each model."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.recognition.hmm.emissions import Gaussian, ModelError, ObservationError
from hmcs.recognition.hmm.topologies import (
    fully_connected,
    left_right,
    start_in,
)
from hmcs_baselines.hmm.bank import LOST, ForwardBank, GaussianScores

TOPOLOGIES = {
    "full": lambda n: fully_connected(n),
    "left-right": lambda n: left_right(n, 0.3, skip=0.2),
    "leaving": lambda n: left_right(n, 0.3, leaves=True),
    "back steps": lambda n: left_right(n, 0.3)[::-1, ::-1],
}


def filtered_alone(initial, transition, log_emission):
    """One model, an observation after the other; states below LOST are lost."""
    predicted, log_scales = initial, []
    for emission in log_emission:
        predicted = np.where(predicted < LOST, 0.0, predicted)
        top = emission[predicted > 0].max()
        joint = predicted * np.exp(np.minimum(emission - top, 0.0))
        log_scales.append(np.log(joint.sum()) + top)
        states = joint / joint.sum()
        predicted = states @ transition
    return states, np.array(log_scales)


@given(
    seed=st.integers(0, 10_000),
    topology=st.sampled_from(sorted(TOPOLOGIES)),
    models=st.integers(1, 4),
    states=st.integers(1, 9),
    spread=st.sampled_from([1.0, 400.0]),
)
@settings(max_examples=40)
def test_every_model_is_filtered_as_by_itself(seed, topology, models, states, spread):
    rng = np.random.default_rng(seed)
    initial = rng.dirichlet(np.ones(states), models)
    transition = np.stack([TOPOLOGIES[topology](states)] * models)
    transition *= rng.uniform(0.9, 1.0, size=(models, 1, 1))
    seen = spread * rng.normal(size=(12, models, states))
    bank = ForwardBank(initial, transition)
    np.testing.assert_array_equal(bank.states, initial)
    increments = []
    for log_emission in seen:
        increments.append(bank.step(log_emission))
    for m in range(models):
        states, log_scales = filtered_alone(initial[m], transition[m], seen[:, m])
        np.testing.assert_allclose(np.array(increments)[:, m], log_scales, atol=1e-9)
        np.testing.assert_allclose(bank.states[m], states, atol=1e-12)
    np.testing.assert_allclose(bank.log_likelihood, np.sum(increments, axis=0))


def test_an_impossible_observation_ends_its_model_and_no_other():
    bank = ForwardBank(np.full((2, 2), 0.5), np.full((2, 2, 2), 0.5))
    with np.errstate(all="raise"):
        assert bank.step(np.array([[-np.inf, -np.inf], [-1.0, -1.0]])).tolist() == [-np.inf, -1.0]
        assert bank.step(np.zeros((2, 2))).tolist() == [-np.inf, 0.0]
    assert bank.states.tolist() == [[0.0, 0.0], [0.5, 0.5]]
    assert bank.log_likelihood.tolist() == [-np.inf, -1.0]


def test_reset_forgets():
    rng = np.random.default_rng(1)
    bank = ForwardBank(np.stack([start_in(5)] * 3), np.stack([left_right(5, 0.3)] * 3))
    seen = rng.normal(size=(6, 3, 5))
    first = [bank.step(each) for each in seen]
    bank.reset()
    np.testing.assert_array_equal([bank.step(each) for each in seen], first)


def test_what_was_returned_stays_what_it_was():
    bank = ForwardBank(np.full((1, 2), 0.5), np.full((1, 2, 2), 0.5))
    bank.step(np.array([[0.0, -1.0]]))
    states, total = bank.states, bank.log_likelihood
    kept = states.copy(), total.copy()
    bank.step(np.array([[-5.0, -1.0]]))
    np.testing.assert_array_equal(states, kept[0])
    np.testing.assert_array_equal(total, kept[1])


@pytest.mark.parametrize("shape", [(3,), (4, 3)])
def test_gaussian_scores_are_those_of_each_model(shape):
    rng = np.random.default_rng(2)
    means, variances = rng.normal(size=(4, 5, 3)), rng.uniform(0.1, 2.0, size=(4, 5, 3))
    seen = rng.normal(size=shape)
    scored = GaussianScores(means, variances).log_emission(seen)
    for m, vector in enumerate(np.broadcast_to(seen, (4, 3))):
        alone = Gaussian(means[m], variances[m]).log_likelihood(vector[None])
        np.testing.assert_allclose(scored[m], alone[0])


def test_what_does_not_fit_is_refused():
    with pytest.raises(ModelError, match=r"\(M, N\) and \(M, N, N\)"):
        ForwardBank(np.ones((2, 3)), np.ones((2, 3, 4)))
    with pytest.raises(ModelError, match=r"\(M, N, F\)"):
        GaussianScores(np.zeros((2, 3)), np.ones((2, 3)))
    with pytest.raises(ModelError, match="above 0"):
        GaussianScores(np.zeros((2, 3, 1)), np.zeros((2, 3, 1)))
    bank = ForwardBank(np.full((2, 2), 0.5), np.full((2, 2, 2), 0.5))
    with pytest.raises(ObservationError, match=r"give \(2, 2\)"):
        bank.step(np.zeros(2))
    scores = GaussianScores(np.zeros((2, 2, 3)), np.ones((2, 2, 3)))
    with pytest.raises(ObservationError, match=r"give \(3,\) or \(2, 3\)"):
        scores.log_emission(np.zeros(2))
    with pytest.raises(ObservationError, match="not finite"):
        scores.log_emission(np.array([0.0, np.nan, 0.0]))


def test_a_state_all_but_impossible_is_lost_whatever_it_would_explain():
    transition = np.array([[[1.0 - 1e-305, 1e-305], [0.0, 1.0]]])
    bank = ForwardBank(np.array([[1.0, 0.0]]), transition)
    bank.step(np.zeros((1, 2)))
    gain = bank.step(np.array([[0.0, 2_000.0]]))
    np.testing.assert_array_equal(bank.states, [[1.0, 0.0]])
    assert gain == pytest.approx(0.0)
