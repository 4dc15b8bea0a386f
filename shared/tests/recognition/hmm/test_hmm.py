"""The HMM against enumeration of every state path and against hmmlearn."""

from itertools import product

import numpy as np
import pytest
from hmmlearn.hmm import GaussianHMM
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.recognition.hmm.emissions import log_gaussians
from hmcs.recognition.hmm.inference import (
    ImpossibleSequenceError,
    forward,
    log_likelihood,
    smooth,
    viterbi,
)
from hmcs.recognition.hmm.learning import GaussianHmm, baum_welch


def random_model(seed: int, states: int, dimensions: int = 2) -> GaussianHmm:
    rng = np.random.default_rng(seed)
    return GaussianHmm(
        rng.dirichlet(np.ones(states)),
        rng.dirichlet(np.ones(states), size=states),
        rng.normal(size=(states, dimensions)),
        rng.uniform(0.2, 2.0, size=(states, dimensions)),
    )


def every_path(model, log_emission):
    """Joint probability of every hidden path with the observations."""
    steps, states = log_emission.shape
    for path in product(range(states), repeat=steps):
        p = model.initial[path[0]] * np.exp(log_emission[0, path[0]])
        for t in range(1, steps):
            p *= model.transition[path[t - 1], path[t]] * np.exp(log_emission[t, path[t]])
        yield path, p


@given(seed=st.integers(0, 10_000), states=st.integers(1, 3), steps=st.integers(1, 5))
@settings(max_examples=25, deadline=None)
def test_inference_equals_the_sum_over_every_state_path(seed, states, steps):
    model = random_model(seed, states)
    observations = np.random.default_rng(seed + 1).normal(size=(steps, 2))
    emission = log_gaussians(model.means, model.variances, observations)
    paths = list(every_path(model, emission))
    total = sum(p for _, p in paths)

    assert log_likelihood(model.initial, model.transition, emission) == pytest.approx(np.log(total))
    best_path, best = max(paths, key=lambda item: item[1])
    path, log_best = viterbi(model.initial, model.transition, emission)
    assert log_best == pytest.approx(np.log(best))
    assert tuple(path) == best_path

    smoothed = smooth(model.initial, model.transition, emission)
    expected = np.zeros((steps, states))
    moved = np.zeros((states, states))
    for hidden, p in paths:
        for t, state in enumerate(hidden):
            expected[t, state] += p / total
            if t:
                moved[hidden[t - 1], state] += p / total
    np.testing.assert_allclose(smoothed.states, expected, atol=1e-12)
    np.testing.assert_allclose(smoothed.transitions, moved, atol=1e-12)


def test_alpha_is_the_joint_probability_of_observations_and_state():
    model = random_model(3, 2)
    observations = np.random.default_rng(4).normal(size=(3, 2))
    emission = log_gaussians(model.means, model.variances, observations)
    joint = np.zeros(2)
    for path, p in every_path(model, emission):
        joint[path[-1]] += p
    alpha = forward(model.initial, model.transition, emission)
    np.testing.assert_allclose(np.exp(alpha[-1]), joint)


def as_hmmlearn(model: GaussianHmm, iterations: int) -> GaussianHMM:
    peer = GaussianHMM(
        len(model.initial),
        covariance_type="diag",
        init_params="",
        n_iter=iterations,
        tol=-np.inf,
        covars_prior=0.0,
        covars_weight=1.0,
        min_covar=0.0,
    )
    peer.startprob_, peer.transmat_ = model.initial, model.transition
    peer.means_, peer.covars_ = model.means, model.variances
    return peer


@pytest.mark.parametrize("seed", range(4))
def test_learning_takes_the_same_steps_as_hmmlearn(seed):
    model = random_model(seed, 3)
    rng = np.random.default_rng(seed + 50)
    sequences = [rng.normal(size=(n, 2)) for n in (12, 30, 7)]
    stacked = np.concatenate(sequences)
    lengths = [len(sequence) for sequence in sequences]
    peer = as_hmmlearn(model, 8)
    assert peer.score(stacked, lengths) == pytest.approx(
        sum(
            log_likelihood(
                model.initial,
                model.transition,
                log_gaussians(model.means, model.variances, sequence),
            )
            for sequence in sequences
        )
    )
    peer.fit(stacked, lengths)
    ours = baum_welch(model, sequences, max_iterations=8, tolerance=-np.inf, variance_floor=0.0)
    np.testing.assert_allclose(ours.model.means, peer.means_, rtol=1e-5, atol=1e-8)
    np.testing.assert_allclose(ours.model.transition, peer.transmat_, rtol=1e-5, atol=1e-8)
    np.testing.assert_allclose(
        ours.model.variances, np.stack([np.diag(c) for c in peer.covars_]), rtol=1e-5, atol=1e-8
    )


@pytest.mark.parametrize("seed", range(6))
def test_every_iteration_of_learning_raises_the_likelihood(seed):
    rng = np.random.default_rng(seed)
    sequences = [rng.normal(size=(20, 2)) for _ in range(3)]
    learned = baum_welch(random_model(seed, 4), sequences, max_iterations=15, tolerance=-np.inf)
    assert (np.diff(learned.log_likelihoods) > -1e-8).all()


def test_structural_zeros_and_exits_survive_learning():
    transition = np.array([[0.6, 0.4, 0.0], [0.0, 0.7, 0.3], [0.0, 0.0, 0.9]])
    base = random_model(1, 3)
    model = GaussianHmm(np.array([1.0, 0.0, 0.0]), transition, base.means, base.variances)
    sequences = [np.random.default_rng(k).normal(size=(15, 2)) for k in range(3)]
    learned = baum_welch(model, sequences, max_iterations=5).model
    assert (learned.transition[transition == 0] == 0).all()
    np.testing.assert_allclose(learned.initial, model.initial, atol=1e-12)
    assert (learned.initial[1:] == 0).all()
    assert learned.transition[2].sum() == pytest.approx(0.9)


def test_an_impossible_sequence_is_named_with_its_first_impossible_observation():
    emission = np.zeros((4, 2))
    emission[2] = -np.inf
    with pytest.raises(ImpossibleSequenceError, match="observation 2"):
        smooth(np.array([0.5, 0.5]), np.full((2, 2), 0.5), emission)
