"""However far observations lie from a model, probabilities sum to one, also of what is learned."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.errors import UserError
from hmcs.recognition.hmm.emissions import Discrete, Gaussian, Mixture
from hmcs.recognition.hmm.inference import (
    forward,
    log_filtered,
    log_likelihood,
    shortest_path,
    smooth,
)
from hmcs.recognition.hmm.learning import baum_welch, segmental_k_means
from hmcs.recognition.hmm.log_transitions import LogTransitions
from hmcs.recognition.hmm.model import Hmm, posterior, validate
from hmcs.recognition.hmm.topologies import left_right, start_in
from hmcs_baselines.hmm.batch import baum_welch_many
from hmcs_baselines.hmm.layer_stack import Layer, LayerStackFilter
from hmcs_baselines.hmm.semi_markov import decoded, duration_hmm, filtered, smoothed

OFFSETS = [0.0, 1e3, 1e7, 1e9, 1e12]
seeds = st.integers(0, 10_000)


def gaussian(seed: int, states: int = 3, dimensions: int = 3) -> Hmm[Gaussian]:
    rng = np.random.default_rng(seed)
    emission = Gaussian(rng.normal(size=(states, dimensions)), np.ones((states, dimensions)))
    return Hmm(np.full(states, 1 / states), np.full((states, states), 1 / states), emission)


def mixture(seed: int, states: int = 3, components: int = 4) -> Hmm[Mixture]:
    rng = np.random.default_rng(seed)
    shape = (states, components, 3)
    emission = Mixture(np.full(shape[:2], 1 / components), rng.normal(size=shape), np.ones(shape))
    return Hmm(np.full(states, 1 / states), np.full((states, states), 1 / states), emission)


def vectors(seed: int, steps: int = 40) -> np.ndarray:
    return np.random.default_rng([seed, 1]).normal(size=(steps, 3))


def with_outlier(observations: np.ndarray, far: float) -> np.ndarray:
    return np.vstack([observations, [far, 0.0, 0.0], observations])


# --- inference ------------------------------------------------------------------------------------


def exact_log_emission(seed: int, steps: int, states: int) -> np.ndarray:
    """Numbers of few binary digits: sums with whole numbers are exact."""
    return np.round(np.random.default_rng(seed).normal(-2, 4, (steps, states)) * 64) / 64


def shifts(seed: int, steps: int) -> np.ndarray:
    return np.random.default_rng([seed, 3]).integers(-(2**40), 2**40, (steps, 1)).astype(float)


@given(seeds, st.integers(1, 4), st.integers(1, 12))
@settings(max_examples=60)
def test_what_all_states_have_in_common_tells_nothing(seed: int, states: int, steps: int) -> None:
    rng = np.random.default_rng([seed, 2])
    chain = rng.dirichlet(np.ones(states)), rng.dirichlet(np.ones(states), states)
    near = exact_log_emission(seed, steps, states)
    far = near + shifts(seed, steps)
    expected = smooth(*chain, near)
    found = smooth(*chain, far)
    np.testing.assert_allclose(found.states, expected.states, atol=1e-12)
    np.testing.assert_allclose(found.transitions, expected.transitions, atol=1e-12)
    passed = [log_filtered(chain[0], LogTransitions(chain[1]), each) for each in (far, near)]
    np.testing.assert_allclose(*(np.exp(each.log_states) for each in passed), atol=1e-12)
    np.testing.assert_array_equal(shortest_path(*chain, far).path, shortest_path(*chain, near).path)
    assert log_likelihood(*chain, far) == pytest.approx(found.log_likelihood)


@given(seeds, st.integers(1, 3), st.integers(1, 4), st.integers(1, 10))
@settings(max_examples=60)
def test_what_all_states_have_in_common_tells_nothing_of_durations(
    seed: int, states: int, longest: int, steps: int
) -> None:
    rng = np.random.default_rng([seed, 2])
    model = duration_hmm(
        rng.dirichlet(np.ones(states)),
        rng.dirichlet(np.ones(states), states),
        rng.dirichlet(np.ones(longest), states),
    )
    near = exact_log_emission(seed, steps, states)
    far = near + shifts(seed, steps)
    np.testing.assert_allclose(
        filtered(model, far).states, filtered(model, near).states, atol=1e-12
    )
    np.testing.assert_allclose(smoothed(model, far), smoothed(model, near), atol=1e-12)
    np.testing.assert_array_equal(decoded(model, far).states, decoded(model, near).states)


@given(seeds, st.integers(2, 9), st.integers(1, 3))
@settings(max_examples=60)
def test_few_diagonals_make_the_same_sums_as_the_whole_matrix(
    seed: int, states: int, skips: int
) -> None:
    rng = np.random.default_rng(seed)
    transition = np.tril(np.triu(rng.uniform(0.1, 1.0, (states, states))), skips)
    if rng.uniform() < 0.5:
        transition = transition[::-1, ::-1].copy()
    transition[rng.uniform(size=transition.shape) < 0.2] = 0.0
    ways = LogTransitions(transition)
    here, there = rng.normal(size=(2, 7, states))
    np.testing.assert_allclose(
        np.exp(ways.ahead(here[0])), np.exp(here[0]) @ transition, atol=1e-12
    )
    np.testing.assert_allclose(
        np.exp(ways.back(there[0])), transition @ np.exp(there[0]), atol=1e-12
    )
    np.testing.assert_allclose(
        ways.summed(here, there), (np.exp(here).T @ np.exp(there)) * transition, atol=1e-12
    )


def test_a_long_left_right_model_is_smoothed_as_its_whole_matrix_would_be() -> None:
    states = 30
    transition = left_right(states, 0.4)
    emission = np.random.default_rng(0).normal(size=(60, states))
    found = smooth(start_in(states), transition, emission)
    # A vanishing way from everywhere to everywhere: no diagonal is left out then.
    dense = smooth(start_in(states), transition + 1e-250, emission)
    np.testing.assert_allclose(found.states, dense.states, atol=1e-12)
    np.testing.assert_allclose(found.transitions, dense.transitions, atol=1e-12)
    alpha = forward(start_in(states), transition, emission)
    assert found.log_likelihood == pytest.approx(np.logaddexp.reduce(alpha[-1]))


@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("make", [gaussian, mixture])
def test_posteriors_sum_to_one_at_any_distance(make, offset: float) -> None:
    for observations in (vectors(0) + offset, with_outlier(vectors(0), offset)):
        states, transitions, _ = posterior(make(0), observations)
        np.testing.assert_allclose(states.sum(axis=1), 1.0, atol=1e-12)
        np.testing.assert_allclose(transitions.sum(), len(observations) - 1)
        assert states.min() >= 0


@pytest.mark.parametrize("offset", OFFSETS)
def test_the_beliefs_of_layers_sum_to_one_at_any_distance(offset: float) -> None:
    upper = Hmm(np.full(2, 0.5), np.full((2, 2), 0.5), Discrete(np.full((2, 3), 1 / 3)))
    layers = [
        Layer(tuple(gaussian(seed) for seed in range(3)), window=5),
        Layer((upper,)),
    ]
    layered = LayerStackFilter(layers)
    for observation in vectors(0) + offset:
        for belief in layered.step(observation):
            assert belief.models.sum() == pytest.approx(1.0)
            assert sum(states.sum() for states in belief.states) == pytest.approx(1.0)


# --- learning -------------------------------------------------------------------------------------


@pytest.mark.parametrize("learner", [baum_welch, segmental_k_means])
@pytest.mark.parametrize("make", [gaussian, mixture])
@pytest.mark.parametrize("offset", OFFSETS)
def test_what_is_learned_far_from_the_first_guess_is_a_model(learner, make, offset: float) -> None:
    for observations in (vectors(0) + offset, with_outlier(vectors(0), offset)):
        for iterations in (1, 10):
            learned = learner(make(0), [observations], max_iterations=iterations).model
            validate(learned)
            assert np.isfinite(learned.emission.means).all()
            assert np.isfinite(learned.emission.variances).all()
            assert (learned.emission.variances > 0).all()


@pytest.mark.parametrize("offset", [2.0**10, 2.0**20, 2.0**30])
def test_learning_does_not_depend_on_where_zero_is(offset: float) -> None:
    # Few binary digits: what is moved by a power of two is moved exactly.
    observations = np.round(vectors(1) * 1024) / 1024
    model = gaussian(2)
    means = np.round(model.emission.means * 1024) / 1024
    near = Hmm(*model[:2], Gaussian(means, model.emission.variances))
    far = Hmm(*model[:2], Gaussian(means + offset, model.emission.variances))
    for here, there in zip(
        (baum_welch(near, [observations]), *baum_welch_many([near], [[observations]])),
        (
            baum_welch(far, [observations + offset]),
            *baum_welch_many([far], [[observations + offset]]),
        ),
        strict=True,
    ):
        # Means far from zero have fewer digits behind the point.
        digits = 1e-12 + 1e-12 * offset
        np.testing.assert_allclose(there.model.transition, here.model.transition, atol=digits)
        np.testing.assert_allclose(
            there.model.emission.means - offset, here.model.emission.means, atol=digits
        )
        np.testing.assert_allclose(
            there.model.emission.variances, here.model.emission.variances, atol=digits
        )


@given(
    seeds,
    st.integers(1, 12),
    st.sampled_from([1e-9, 1.0, 1e6, 1e150]),
    st.sampled_from([0.0, -1e9, 1e15, 1e200]),
    st.booleans(),
    st.sampled_from([gaussian, mixture]),
)
@settings(max_examples=150, deadline=None)
def test_any_observations_make_a_model_or_a_clear_error(
    seed: int, steps: int, size: float, offset: float, equal: bool, make
) -> None:
    observations = vectors(seed, steps) * size + offset
    if equal:
        observations[:] = observations[0]
    with np.errstate(over="ignore"):
        try:
            learned, history = baum_welch(make(seed), [observations], max_iterations=5)
        except UserError:
            return
    validate(learned)
    assert np.isfinite(learned.emission.means).all()
    rounding = 1e-9 * (1.0 + abs(history[0]))
    assert all(after >= before - rounding for before, after in pairwise(history))


def test_a_state_that_explains_nothing_stays_as_it_was() -> None:
    # The third state can never be entered.
    emission = Gaussian(np.array([[0.0], [1.0], [9.0]]), np.ones((3, 1)))
    transition = np.array([[0.5, 0.5, 0.0], [0.5, 0.5, 0.0], [0.0, 0.0, 1.0]])
    model = Hmm(np.array([0.5, 0.5, 0.0]), transition, emission)
    for learned in (
        baum_welch(model, [vectors(3)[:, :1]]).model,
        baum_welch_many([model], [[vectors(3)[:, :1]]])[0].model,
    ):
        validate(learned)
        assert learned.emission.means[2] == 9.0
        np.testing.assert_array_equal(learned.transition[2], transition[2])


def test_one_observation_teaches_no_transition_and_says_so() -> None:
    with pytest.raises(UserError, match="single observation"):
        baum_welch(gaussian(0), [vectors(0, 1)])


def test_equal_observations_teach_no_variance_and_say_so() -> None:
    with pytest.raises(UserError, match="all 9 observations are equal"):
        baum_welch(gaussian(0), [np.ones((9, 3))])
