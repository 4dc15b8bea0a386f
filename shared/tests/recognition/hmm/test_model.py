"""A model's checks, its errors, and what is drawn from it."""

import numpy as np
import pytest
from hmmlearn.hmm import GMMHMM, CategoricalHMM, GaussianHMM

from hmcs.recognition.hmm.emissions import Discrete, Gaussian, ModelError, ObservationError
from hmcs.recognition.hmm.inference import ImpossibleSequenceError
from hmcs.recognition.hmm.model import Hmm, decode, evaluate, posterior, sample, validate
from hmcs.recognition.hmm.topologies import left_right, start_in

COIN = Discrete(np.array([[0.5, 0.5], [1.0, 0.0]]))


def as_hmmlearn(model):
    emission = model.emission
    if isinstance(emission, Discrete):
        peer = CategoricalHMM(len(model.initial), n_features=emission.probabilities.shape[1])
        peer.emissionprob_ = emission.probabilities
    elif isinstance(emission, Gaussian):
        peer = GaussianHMM(len(model.initial), covariance_type="diag")
        peer.means_, peer.covars_ = emission.means, emission.variances
    else:
        peer = GMMHMM(len(model.initial), emission.weights.shape[1], covariance_type="diag")
        peer.weights_, peer.means_ = emission.weights, emission.means
        peer.covars_ = emission.variances
        peer.n_features = emission.means.shape[2]
    peer.startprob_, peer.transmat_ = model.initial, model.transition
    return peer


def symbol_shares(emission, state):
    """Of each dimension the probabilities of its symbols; of none if there are no symbols."""
    dimensions = getattr(emission, "dimensions", [emission])
    return [d.probabilities[state] for d in dimensions if isinstance(d, Discrete)]


def moments(emission, state):
    """The mean and the variance of each dimension."""
    weights = getattr(emission, "weights", np.ones((3, 1)))[state][:, None]
    means = emission.means[state].reshape(len(weights), -1)
    variances = emission.variances[state].reshape(len(weights), -1)
    mean = (weights * means).sum(axis=0)
    return mean, (weights * (variances + means**2)).sum(axis=0) - mean**2


@pytest.mark.parametrize("kind", ["discrete", "gaussian", "mixture"])
@pytest.mark.parametrize("seed", range(3))
def test_scores_paths_and_posteriors_are_those_of_hmmlearn(random_model, kind, seed):
    model = random_model(kind, seed, 3)
    seen = sample(model, 40, np.random.default_rng(seed)).observations
    peer = as_hmmlearn(model)
    columns = seen[:, None] if kind == "discrete" else seen
    log_probability, posteriors = peer.score_samples(columns)
    assert evaluate(model, seen) == pytest.approx(log_probability)
    np.testing.assert_allclose(posterior(model, seen).states, posteriors, atol=1e-9)
    log_joint, path = peer.decode(columns)
    decoded = decode(model, seen)
    assert -decoded.cost == pytest.approx(log_joint)
    # Symbols leave ties, which each breaks in its own way.
    assert kind == "discrete" or (decoded.path == path).all()


def test_an_impossible_observation_is_named_with_its_symbol():
    model = Hmm(np.array([0.0, 1.0]), np.eye(2), COIN)
    for infer in (decode, posterior):
        with pytest.raises(ImpossibleSequenceError, match=r"observation 2 .*observed there: 1"):
            infer(model, np.array([0, 0, 1, 0]))
    assert evaluate(model, np.array([0, 0, 1, 0])) == -np.inf


def test_an_empty_sequence_is_refused():
    model = Hmm(np.array([0.0, 1.0]), np.eye(2), COIN)
    for use in (evaluate, decode, posterior):
        with pytest.raises(ObservationError, match="empty"):
            use(model, np.array([], dtype=np.int64))


@pytest.mark.parametrize(
    ("initial", "transition", "says"),
    [
        ([0.5, 0.4], np.eye(2), "sum to 0.9"),
        ([1.5, -0.5], np.eye(2), "sum to one"),
        ([np.nan, 1.0], np.eye(2), "sum to one"),
        ([0.5, 0.5], np.array([[1.0, 0.0], [0.6, 0.6]]), "row 1 .*sums to 1.2"),
        ([0.5, 0.5], np.array([[-0.1, 1.0], [0.5, 0.5]]), "row 0"),
        ([0.5, 0.5], np.array([[0.5, np.nan], [0.5, 0.5]]), "row 0"),
        ([0.5, 0.5], np.eye(3), r"\(2,\) and \(2, 2\)"),
        ([1.0], np.eye(1), r"\(2,\) and \(2, 2\)"),
    ],
)
def test_what_is_no_model_is_refused_with_the_place(initial, transition, says):
    with pytest.raises(ModelError, match=says):
        validate(Hmm(np.array(initial), transition, COIN))


def test_a_row_may_leave_the_model():
    model = Hmm(start_in(2), left_right(2, 0.2, leaves=True), COIN)
    assert validate(model) is model


@pytest.mark.parametrize("kind", ["discrete", "multi-discrete", "gaussian", "mixture"])
def test_samples_have_the_chain_and_the_emissions_of_the_model(random_model, kind):
    model = random_model(kind, 2, 3)
    drawn = sample(model, 20_000, np.random.default_rng(0))
    moved = np.zeros((3, 3))
    np.add.at(moved, (drawn.path[:-1], drawn.path[1:]), 1.0)
    np.testing.assert_allclose(
        moved / moved.sum(axis=1, keepdims=True), model.transition, atol=0.03
    )
    for state in range(3):
        own = drawn.observations[drawn.path == state]
        error = 5.0 / np.sqrt(len(own))
        for column, shares in zip(
            own.reshape(len(own), -1).T, symbol_shares(model.emission, state), strict=False
        ):
            counted = np.bincount(column.astype(int), minlength=len(shares)) / len(own)
            np.testing.assert_allclose(counted, shares, atol=error)
        if kind in ("gaussian", "mixture"):
            mean, variance = moments(model.emission, state)
            np.testing.assert_allclose(own.mean(axis=0), mean, atol=error * variance.max() ** 0.5)
            np.testing.assert_allclose(own.var(axis=0), variance, rtol=3 * error)


def test_a_sample_ends_where_the_model_is_left():
    model = Hmm(start_in(2), left_right(2, 0.5, leaves=True), COIN)
    rng = np.random.default_rng(1)
    samples = [sample(model, 1000, rng) for _ in range(400)]
    lengths = [len(drawn.path) for drawn in samples]
    assert all(
        drawn.path[-1] == 1 and len(drawn.observations) == n
        for drawn, n in zip(samples, lengths, strict=True)
    )
    # Two states that are each left with probability one half last two steps each.
    assert np.mean(lengths) == pytest.approx(4.0, abs=0.4)


def test_equal_generators_draw_equal_samples(random_model):
    model = random_model("gaussian", 1, 3)
    first, second = (sample(model, 30, np.random.default_rng(9)) for _ in range(2))
    np.testing.assert_array_equal(first.observations, second.observations)


def test_nothing_can_not_be_sampled(random_model):
    with pytest.raises(ModelError, match="at least one"):
        sample(random_model("gaussian", 1, 3), 0, np.random.default_rng(0))
