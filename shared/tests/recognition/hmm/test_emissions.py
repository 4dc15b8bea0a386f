"""Emissions: what they score, what re-estimation makes of them, and what they refuse."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.errors import UserError
from hmcs.recognition.hmm.emissions import (
    Discrete,
    Estimated,
    Gaussian,
    Mixture,
    ModelError,
    MultiDiscrete,
    ObservationError,
    floored,
)

SYMBOLS = np.array([0, 2, 1, 2])


def weighted_log_likelihood(emission, sequences, posteriors):
    return sum(
        (posterior * emission.log_likelihood(sequence)).sum()
        for sequence, posterior in zip(sequences, posteriors, strict=True)
    )


def test_a_symbol_scores_its_entry_of_b():
    B = np.array([[0.5, 0.3, 0.2], [0.0, 0.1, 0.9]])
    np.testing.assert_allclose(np.exp(Discrete(B).log_likelihood(SYMBOLS)), B.T[SYMBOLS])


def test_dimensions_multiply():
    first = Discrete(np.array([[0.5, 0.3, 0.2], [0.1, 0.1, 0.8]]))
    second = Discrete(np.array([[0.25, 0.75], [0.5, 0.5]]))
    other = np.array([1, 1, 0, 1])
    both = MultiDiscrete((first, second)).log_likelihood(np.stack([SYMBOLS, other], axis=1))
    np.testing.assert_allclose(both, first.log_likelihood(SYMBOLS) + second.log_likelihood(other))


def test_a_gaussian_scores_the_density_of_the_text():
    mean, sigma, seen = 1.5, 0.4, 1.1
    scored = Gaussian(np.array([[mean]]), np.array([[sigma**2]])).log_likelihood(np.array([[seen]]))
    density = np.exp(-((seen - mean) ** 2) / (2 * sigma**2)) / (np.sqrt(2 * np.pi) * sigma)
    assert np.exp(scored[0, 0]) == pytest.approx(density)


def test_a_mixture_is_the_weighted_sum_of_its_components(random_emission):
    mixture = random_emission("mixture", 5, 3)
    seen = np.random.default_rng(6).normal(size=(7, 2))
    total = sum(
        mixture.weights[:, k]
        * np.exp(Gaussian(mixture.means[:, k], mixture.variances[:, k]).log_likelihood(seen))
        for k in range(2)
    )
    np.testing.assert_allclose(np.exp(mixture.log_likelihood(seen)), total)


def test_a_mixture_with_one_component_is_a_gaussian(random_emission):
    gaussian = random_emission("gaussian", 5, 3)
    mixture = Mixture(np.ones((3, 1)), gaussian.means[:, None], gaussian.variances[:, None])
    seen = [np.random.default_rng(6).normal(size=(9, 2))]
    posterior = [np.random.default_rng(7).dirichlet(np.ones(3), 9)]
    learned, same = (e.reestimated(seen, posterior) for e in (mixture, gaussian))
    np.testing.assert_allclose(learned.means[:, 0], same.means)
    np.testing.assert_allclose(learned.variances[:, 0], same.variances)


def test_an_estimator_is_inverted_by_bayes_rule():
    shares = np.array([0.8, 0.2])
    rows = np.array([[0.8, 0.2], [0.5, 0.5], [1.0, 0.0]])
    estimated = Estimated(shares)
    np.testing.assert_allclose(np.exp(estimated.log_likelihood(rows)), rows / shares)
    assert estimated.reestimated([rows], [rows]) is estimated


@given(
    seed=st.integers(0, 10_000),
    kind=st.sampled_from(["discrete", "multi-discrete", "gaussian", "mixture"]),
)
@settings(max_examples=30)
def test_reestimation_never_lowers_the_weighted_likelihood(random_emission, seed, kind):
    rng = np.random.default_rng([seed, 3])
    emission = random_emission(kind, seed, 3)
    sequences = [
        {
            "discrete": lambda n: rng.integers(0, 4, n),
            "multi-discrete": lambda n: rng.integers(0, 3, (n, 2)),
        }.get(kind, lambda n: rng.normal(size=(n, 2)))(n)
        for n in (5, 12)
    ]
    posteriors = [rng.dirichlet(np.ones(3), len(sequence)) for sequence in sequences]
    learned = emission.reestimated(sequences, posteriors)
    before, after = (weighted_log_likelihood(e, sequences, posteriors) for e in (emission, learned))
    assert after >= before - 1e-9


def test_reestimated_symbols_are_counted_over_all_sequences():
    emission = Discrete(np.full((2, 3), 1 / 3))
    sequences = [np.array([0, 1]), np.array([0])]
    posteriors = [np.array([[1.0, 0.0], [0.25, 0.75]]), np.array([[0.5, 0.5]])]
    learned = emission.reestimated(sequences, posteriors).probabilities
    np.testing.assert_allclose(
        learned, [[1.5 / 1.75, 0.25 / 1.75, 0.0], [0.5 / 1.25, 0.75 / 1.25, 0.0]]
    )


@given(
    seed=st.integers(0, 10_000),
    symbols=st.integers(2, 8),
    share=st.floats(0.0, 1.0),
)
@settings(max_examples=40)
def test_the_floor_is_honored_and_rows_still_sum_to_one(seed, symbols, share):
    rng = np.random.default_rng(seed)
    floor = share / symbols
    emission = Discrete(np.full((2, symbols), 1 / symbols), floor)
    sequence = rng.integers(0, symbols, 3)
    learned = emission.reestimated([sequence], [rng.dirichlet(np.ones(2), 3)]).probabilities
    assert (learned >= floor * (1 - 1e-12)).all()
    np.testing.assert_allclose(learned.sum(axis=1), 1.0)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=20)
def test_no_row_above_the_floor_explains_counts_better_than_the_floored_one(seed):
    rng = np.random.default_rng(seed)
    counts = rng.dirichlet(np.full(4, 0.3))[None]
    best = floored(counts, 0.05)
    others = 0.05 + 0.8 * rng.dirichlet(np.ones(4), 200)
    assert (counts * np.log(best)).sum() >= (counts * np.log(others)).sum(axis=1).max() - 1e-12


def test_without_a_floor_zeros_of_b_stay():
    emission = Discrete(np.array([[0.0, 0.5, 0.5], [0.5, 0.5, 0.0]]))
    posterior = np.array([[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]])
    learned = emission.reestimated([np.array([0, 1, 2])], [posterior])
    assert (learned.probabilities[emission.probabilities == 0] == 0).all()


@pytest.mark.parametrize("kind", ["discrete", "gaussian", "mixture"])
def test_a_state_never_visited_keeps_what_it_has(random_emission, kind):
    emission = random_emission(kind, 4, 2)
    rng = np.random.default_rng(5)
    seen = rng.integers(0, 4, 6) if kind == "discrete" else rng.normal(size=(6, 2))
    posterior = np.zeros((6, 2))
    posterior[:, 0] = 1.0
    learned = emission.reestimated([seen], [posterior])
    name = "probabilities" if kind == "discrete" else "means"
    np.testing.assert_array_equal(getattr(learned, name)[1], getattr(emission, name)[1])
    assert not np.allclose(getattr(learned, name)[0], getattr(emission, name)[0])


def test_the_variance_floor_is_honored():
    emission = Gaussian(np.zeros((1, 2)), np.ones((1, 2)), variance_floor=0.01)
    seen = np.array([[0.0, 1.0], [1.0, 1.0]])
    learned = emission.reestimated([seen], [np.ones((2, 1))])
    np.testing.assert_allclose(learned.variances, [[0.25, 0.01]])


GAUSSIAN = Gaussian(np.zeros((2, 2)), np.ones((2, 2)))


@pytest.mark.parametrize(
    ("emission", "observations", "says"),
    [
        (Discrete(np.full((2, 3), 1 / 3)), np.array([0, 1, 3, 0]), "observation 2 is symbol 3"),
        (Discrete(np.full((2, 3), 1 / 3)), np.array([0, -1]), "observation 1 is symbol -1"),
        (Discrete(np.full((2, 3), 1 / 3)), np.array([0.0, 1.0]), "give integers"),
        (
            MultiDiscrete((Discrete(np.full((2, 3), 1 / 3)), Discrete(np.full((2, 2), 0.5)))),
            np.array([[0, 0], [2, 2]]),
            "dimension 1: observation 1 is symbol 2",
        ),
        (
            MultiDiscrete((Discrete(np.full((2, 3), 1 / 3)),)),
            np.array([[0, 0]]),
            r"give \(T, 1\)",
        ),
        (GAUSSIAN, np.array([[0.0, 0.0], [0.0, np.nan]]), "observation 1 is nan in dimension 1"),
        (GAUSSIAN, np.zeros((3, 3)), r"give \(T, 2\)"),
        (GAUSSIAN, np.zeros(3), r"give \(T, 2\)"),
        (Estimated(np.full(2, 0.5)), np.array([[0.5, 0.5], [0.2, 0.2]]), "observation 1"),
        (Estimated(np.full(2, 0.5)), np.array([[np.nan, 0.5]]), "observation 0 is nan"),
    ],
)
def test_foreign_observations_are_refused_with_their_place(emission, observations, says):
    with pytest.raises(ObservationError, match=says) as raised:
        emission.log_likelihood(observations)
    assert isinstance(raised.value, UserError)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Discrete(np.array([[0.5, 0.5], [0.5, 0.4]])), "state 1 .*sum to 0.9"),
        (lambda: Discrete(np.array([[1.5, -0.5]])), "state 0"),
        (lambda: Discrete(np.array([0.5, 0.5])), "one row for each state"),
        (lambda: Discrete(np.full((1, 4), 0.25), floor=0.3), "from 0 to 1/4"),
        (lambda: MultiDiscrete(()), "no dimensions"),
        (
            lambda: MultiDiscrete((Discrete(np.ones((1, 1))), Discrete(np.ones((2, 1))))),
            "same number",
        ),
        (lambda: Gaussian(np.zeros((2, 2)), np.zeros((2, 2))), "not above 0"),
        (lambda: Gaussian(np.zeros((2, 2)), np.ones((2, 3))), r"\(N, F\)"),
        (lambda: Gaussian(np.full((2, 2), np.nan), np.ones((2, 2))), "no number"),
        (lambda: Gaussian(np.zeros((2, 2)), np.ones((2, 2)), -1.0), "variance_floor"),
        (lambda: Mixture(np.ones((2, 1)), np.zeros((2, 2, 1)), np.ones((2, 2, 1))), "weights"),
        (lambda: Estimated(np.array([1.0, 0.0])), "state 1 has share 0"),
    ],
)
def test_parameters_that_are_no_emission_are_refused(make, says):
    with pytest.raises(ModelError, match=says):
        make()
