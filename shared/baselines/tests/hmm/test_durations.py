"""Explicit durations against the expanded HMM and every segmentation, and their learning."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.recognition.hmm.inference import (
    ImpossibleSequenceError,
    forward,
    log_likelihood,
    shortest_path,
    smooth,
)
from hmcs_baselines.hmm.durations import (
    DurationError,
    dwell_transition,
    geometric_durations,
    learned_durations,
    mean_dwells_s,
    stays,
)
from hmcs_baselines.hmm.markov import MarkovModelError, learned
from hmcs_baselines.hmm.semi_markov import (
    decoded,
    duration_hmm,
    expand,
    filtered,
    smoothed,
)


def random_model(seed, states, longest, ending=False):
    rng = np.random.default_rng(seed)
    stays_inside = rng.uniform(0.3, 1.0, size=(states, 1)) if ending else 1.0
    return duration_hmm(
        rng.dirichlet(np.ones(states)),
        rng.dirichlet(np.ones(states), size=states) * stays_inside,
        rng.dirichlet(np.full(longest, 0.7), size=states),
    )


def random_emission(seed, steps, states):
    return np.random.default_rng(seed).normal(-1.0, 1.5, size=(steps, states))


def segmentations(model, log_emission, path=(), bounds=(), p=None):
    """Every way to cover the observations: (states per step, first steps, joint probability).

    The last segment may reach beyond the observations: one entry for each of its durations.
    """
    steps, states = log_emission.shape
    first = len(path)
    for state, length in product(range(states), range(1, model.durations.shape[1] + 1)):
        enter = model.initial[state] if p is None else p * model.transition[path[-1], state]
        end = min(first + length, steps)
        joint = enter * model.durations[state, length - 1]
        joint *= np.exp(log_emission[first:end, state].sum())
        covered, starts = (*path, *[state] * (end - first)), (*bounds, first)
        if end == steps:
            yield covered, starts, joint
        else:
            yield from segmentations(model, log_emission, covered, starts, joint)


@given(
    seed=st.integers(0, 10_000),
    states=st.integers(1, 3),
    longest=st.integers(1, 3),
    steps=st.integers(1, 4),
    ending=st.booleans(),
)
@settings(max_examples=25)
def test_inference_equals_the_sum_over_every_segmentation(seed, states, longest, steps, ending):
    model = random_model(seed, states, longest, ending)
    emission = random_emission(seed + 1, steps, states)
    ways = list(segmentations(model, emission))
    total = sum(p for *_, p in ways)

    result = filtered(model, emission)
    assert result.log_likelihoods.sum() == pytest.approx(np.log(total))
    last, every = np.zeros(states), np.zeros((steps, states))
    for path, _, p in ways:
        last[path[-1]] += p / total
        every[np.arange(steps), path] += p / total
    np.testing.assert_allclose(result.states[-1], last, atol=1e-12)
    np.testing.assert_allclose(smoothed(model, emission), every, atol=1e-12)

    best = max(p for *_, p in ways)
    found = decoded(model, emission)
    starts = tuple(segment.first for segment in found.segments)
    assert found.log_probability == pytest.approx(np.log(best))
    own = [p for path, bounds, p in ways if path == tuple(found.states) and bounds == starts]
    assert max(own) == pytest.approx(best)
    assert sum(segment.steps for segment in found.segments) == steps


@given(seed=st.integers(0, 10_000), states=st.integers(1, 4), longest=st.integers(1, 7))
@settings(max_examples=20)
def test_the_direct_recursions_equal_the_expanded_hmm(seed, states, longest):
    model = random_model(seed, states, longest)
    emission = random_emission(seed + 1, 30, states)
    flat = expand(model)
    flat_emission = emission[:, flat.state]
    of_state = np.eye(states)[flat.state]
    np.testing.assert_allclose(flat.transition.sum(axis=1), 1.0)

    result = filtered(model, emission)
    log_alpha = forward(flat.initial, flat.transition, flat_emission)
    alpha = np.exp(log_alpha - log_alpha.max(axis=1, keepdims=True)) @ of_state
    np.testing.assert_allclose(result.states, alpha / alpha.sum(axis=1, keepdims=True), atol=1e-12)
    assert result.log_likelihoods.sum() == pytest.approx(
        log_likelihood(flat.initial, flat.transition, flat_emission)
    )
    gamma = smooth(flat.initial, flat.transition, flat_emission).states @ of_state
    np.testing.assert_allclose(smoothed(model, emission), gamma, atol=1e-10)
    best = shortest_path(flat.initial, flat.transition, flat_emission)
    found = decoded(model, emission)
    assert found.log_probability == pytest.approx(-best.cost)
    np.testing.assert_array_equal(found.states, flat.state[best.path])


def test_geometric_durations_are_the_ordinary_hmm_of_mean_dwell_times():
    branches = [[0, 0.3, 0.7, 0], [0, 0, 0, 1], [0, 0, 0, 1], [0, 0, 0, 0]]
    transition = dwell_transition([0.4, 1.0, 0.2, 3.0], 0.1, branches)
    initial = np.array([0.9, 0.1, 0, 0])
    steps = 25
    model = duration_hmm(initial, branches, geometric_durations(np.diag(transition), steps))
    emission = random_emission(5, steps, 4)
    assert filtered(model, emission).log_likelihoods.sum() == pytest.approx(
        log_likelihood(initial, transition, emission)
    )
    np.testing.assert_allclose(
        smoothed(model, emission), smooth(initial, transition, emission).states, atol=1e-12
    )


def test_dwell_times_give_the_stays_and_branches_share_the_rest():
    np.testing.assert_allclose(
        dwell_transition([0.9, 0.4, 5.0], 0.1), [[0.9, 0.1, 0], [0, 0.8, 0.2], [0, 0, 1]]
    )
    shared = dwell_transition([0.9, 1, 1], 0.1, [[0, 0.25, 0.75], [0, 0, 0], [0, 0, 0]])
    np.testing.assert_allclose(shared[0], [0.9, 0.025, 0.075])
    np.testing.assert_allclose(shared.sum(axis=1), 1.0)


def test_dwell_times_of_labels_give_the_most_likely_chain():
    labels = [[0, 0, 0, 1, 1, 2, 2], [0, 1, 1, 1, 1, 2, 2, 2]]
    transition = dwell_transition(mean_dwells_s(labels, 3, 0.02), 0.02)
    np.testing.assert_allclose(transition[:2], learned(labels, 3).transition[:2])


def test_learned_durations_are_the_shares_of_the_stays_seen():
    labels = [[0, 0, 1, 0], [1, 1, 1, 0, 0]]
    assert stays(labels, 2) == [[2, 1, 2], [1, 3]]
    np.testing.assert_allclose(
        learned_durations(labels, 2, 4), [[1 / 3, 2 / 3, 0, 0], [0.5, 0, 0.5, 0]]
    )


def test_spread_gives_lengths_never_seen_their_share():
    spread = learned_durations([[0] * 5 + [1] * 9], 2, 12, spread_steps=1.5)
    np.testing.assert_allclose(spread.sum(axis=1), 1.0)
    assert (spread > 0).all()
    assert spread.argmax(axis=1).tolist() == [4, 8]


def test_sampled_durations_are_learned_again():
    model = random_model(11, 3, 5)
    rng = np.random.default_rng(12)
    path, state = [], 0
    for _ in range(6000):
        path += [state] * int(1 + rng.choice(5, p=model.durations[state]))
        state = (state + int(rng.integers(1, 3))) % 3
    np.testing.assert_allclose(learned_durations([path], 3, 5), model.durations, atol=0.04)


def test_an_explicit_duration_finds_a_boundary_that_observations_do_not_show():
    durations = np.zeros((2, 6))
    durations[:, 3] = 1.0
    model = duration_hmm([1, 0], [[0, 1], [1, 0]], durations)
    found = decoded(model, np.zeros((10, 2)))
    assert [(s.state, s.first, s.steps) for s in found.segments] == [
        (0, 0, 4),
        (1, 4, 4),
        (0, 8, 2),
    ]


def test_an_impossible_sequence_is_named_with_its_first_impossible_observation():
    model = duration_hmm([1, 0], [[0, 1], [0, 0]], [[0, 1, 0], [0, 0, 1]])
    ends = np.zeros((6, 2))
    for run in (filtered, smoothed, decoded):
        run(model, ends[:5])
        with pytest.raises(ImpossibleSequenceError, match="observation 5"):
            run(model, ends)


@pytest.mark.parametrize(
    ("parts", "error", "message"),
    [
        (([1, 0], [[0, 1], [1, 0]], [[0.5, 0.4], [0, 1]]), MarkovModelError, "row 0 of durations"),
        (([1, 0], [[0, 1.1], [1, 0]], [[1], [1]]), MarkovModelError, "row 0 of transition"),
        (([1], [[0, 1], [1, 0]], [[1], [1]]), MarkovModelError, "initial has shape"),
        (([1, 0], [[0, 1]], [[1], [1]]), DurationError, "transition has 1 rows"),
    ],
)
def test_parts_that_make_no_model_are_refused(parts, error, message):
    with pytest.raises(error, match=message):
        duration_hmm(*parts)


@pytest.mark.parametrize(
    ("emission", "message"),
    [
        (np.zeros((0, 2)), "one observation or more"),
        (np.zeros((4, 3)), "log_emission has shape"),
        (np.array([[0, 0], [0, np.nan]]), "observation 1"),
    ],
)
def test_wrong_observations_are_refused(emission, message):
    for run in (filtered, smoothed, decoded):
        with pytest.raises(DurationError, match=message):
            run(random_model(0, 2, 3), emission)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: stays([[0, 0]], 2), "state 1 is never seen"),
        (lambda: learned_durations([[0, 0, 0]], 1, 2), "lasts 3 steps"),
        (lambda: geometric_durations([1.2], 4), "from 0"),
        (lambda: geometric_durations([0.5], 0), "0 steps"),
        (lambda: dwell_transition([-1.0], 0.1), "mean dwell times"),
        (lambda: dwell_transition([], 0.1), "mean dwell times"),
        (lambda: dwell_transition([1.0], 0.0), "sample period"),
        (lambda: dwell_transition([1, 1], 0.1, [[0.5, 0.5], [0, 0]]), "zero diagonal"),
        (lambda: dwell_transition([1, 1], 0.1, [[0, 0.5], [0, 0]]), "sum to 1"),
        (lambda: dwell_transition([1, 1], 0.1, [[0, 1]]), "square"),
    ],
)
def test_wrong_evidence_of_durations_is_refused(call, message):
    with pytest.raises(DurationError, match=message):
        call()


def test_where_staying_and_entering_are_as_probable_it_stays():
    # Two steps of the first state, or one of the second and then the first: 1/4 each, to the bit.
    model = duration_hmm([0.5, 0.5], [[0.0, 1.0], [1.0, 0.0]], [[0.5, 0.5], [1.0, 0.0]])
    found = decoded(model, np.zeros((2, 2)))
    assert [segment.steps for segment in found.segments] == [2]
    assert found.log_probability == np.log(0.25)
