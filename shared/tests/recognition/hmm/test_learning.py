"""Learning against hmmlearn, its promises, and the input it refuses."""

import numpy as np
import pytest
from hmmlearn.hmm import GMMHMM, CategoricalHMM, GaussianHMM
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.errors import UserError
from hmcs.recognition.hmm.emissions import (
    Discrete,
    Estimated,
    Gaussian,
    ModelError,
    ObservationError,
)
from hmcs.recognition.hmm.inference import ImpossibleSequenceError
from hmcs.recognition.hmm.learning import (
    CHAIN,
    EMISSION,
    Parts,
    baum_welch,
    segmental_k_means,
)
from hmcs.recognition.hmm.model import Hmm, decode, evaluate, sample
from hmcs.recognition.hmm.topologies import fully_connected, left_right, start_anywhere, start_in

KINDS = ["discrete", "multi-discrete", "gaussian", "mixture"]


def sequences_of(model, seed, lengths=(12, 30, 7)):
    rng = np.random.default_rng([seed, 9])
    return [sample(model, length, rng).observations for length in lengths]


def as_hmmlearn(model, iterations):
    """The same model with priors that weigh nothing."""
    emission, states = model.emission, len(model.initial)
    common = {"init_params": "", "n_iter": iterations, "tol": -np.inf}
    if isinstance(emission, Discrete):
        peer = CategoricalHMM(states, n_features=emission.probabilities.shape[1], **common)
        peer.emissionprob_ = emission.probabilities
    elif isinstance(emission, Gaussian):
        peer = GaussianHMM(
            states, covariance_type="diag", covars_prior=0.0, covars_weight=1.0, **common
        )
        peer.means_, peer.covars_ = emission.means, emission.variances
    else:
        peer = GMMHMM(states, emission.weights.shape[1], covariance_type="diag", **common)
        peer.weights_, peer.means_ = emission.weights, emission.means
        peer.covars_ = emission.variances
    peer.startprob_, peer.transmat_ = model.initial, model.transition
    return peer


@pytest.mark.parametrize("kind", ["discrete", "gaussian"])
@pytest.mark.parametrize("seed", range(4))
def test_learning_takes_the_same_steps_as_hmmlearn(random_model, kind, seed):
    sequences = sequences_of(random_model(kind, seed + 50, 3), seed)
    model = random_model(kind, seed, 3)
    stacked = np.concatenate(sequences)
    stacked = stacked[:, None] if kind == "discrete" else stacked
    lengths = [len(sequence) for sequence in sequences]
    peer = as_hmmlearn(model, 8).fit(stacked, lengths)
    ours = baum_welch(model, sequences, max_iterations=8, tolerance=-np.inf)
    assert ours.log_likelihoods[-1] == pytest.approx(peer.score(stacked, lengths), rel=1e-7)
    np.testing.assert_allclose(ours.log_likelihoods[:-1], list(peer.monitor_.history)[-8:])
    np.testing.assert_allclose(ours.model.transition, peer.transmat_, rtol=1e-5, atol=1e-8)
    if kind == "discrete":
        np.testing.assert_allclose(
            ours.model.emission.probabilities, peer.emissionprob_, rtol=1e-5, atol=1e-8
        )
    else:
        np.testing.assert_allclose(ours.model.emission.means, peer.means_, rtol=1e-5, atol=1e-8)


@pytest.mark.parametrize("seed", range(4))
def test_a_mixture_takes_the_same_step_as_hmmlearn(random_model, seed):
    sequences = sequences_of(random_model("mixture", seed + 50, 3), seed)
    model = random_model("mixture", seed, 3)
    stacked, lengths = np.concatenate(sequences), [len(sequence) for sequence in sequences]
    peer = as_hmmlearn(model, 1).fit(stacked, lengths)
    ours = baum_welch(model, sequences, max_iterations=1)
    learned = ours.model.emission
    assert ours.log_likelihoods[0] == pytest.approx(peer.monitor_.history[0])
    np.testing.assert_allclose(ours.model.transition, peer.transmat_)
    np.testing.assert_allclose(learned.weights, peer.weights_)
    np.testing.assert_allclose(learned.means, peer.means_)
    # hmmlearn takes the spread around the means before the step, which is larger by their move.
    moved = (learned.means - model.emission.means) ** 2
    np.testing.assert_allclose(learned.variances + moved, peer.covars_)


@given(seed=st.integers(0, 10_000), kind=st.sampled_from(KINDS), floor=st.sampled_from([0.0, 0.02]))
@settings(max_examples=15)
def test_every_iteration_raises_the_likelihood(random_model, seed, kind, floor):
    sequences = sequences_of(random_model(kind, seed + 1, 2), seed)
    initial, transition, emission = random_model(kind, seed, 3)
    if kind == "discrete":
        # The floor holds from the start: what learning compares must respect it throughout.
        emission = Discrete(0.92 * emission.probabilities + 0.02, floor)
    model = Hmm(initial, transition, emission)
    learned = baum_welch(model, sequences, max_iterations=10, tolerance=-np.inf)
    assert len(learned.log_likelihoods) == 11
    assert (np.diff(learned.log_likelihoods) > -1e-8).all()
    total = sum(evaluate(learned.model, sequence) for sequence in sequences)
    assert learned.log_likelihoods[-1] == pytest.approx(total)


@given(seed=st.integers(0, 10_000), kind=st.sampled_from(KINDS))
@settings(max_examples=15)
def test_every_realignment_raises_the_joint_likelihood(random_model, seed, kind):
    sequences = sequences_of(random_model(kind, seed + 1, 2), seed)
    learned = segmental_k_means(random_model(kind, seed, 2), sequences, tolerance=-np.inf)
    assert (np.diff(learned.log_likelihoods) > -1e-8).all()
    total = sum(-decode(learned.model, sequence).cost for sequence in sequences)
    assert learned.log_likelihoods[-1] == pytest.approx(total)


def test_segmental_k_means_stops_when_the_paths_stop_changing(random_model):
    sequences = sequences_of(random_model("gaussian", 8, 2), 3)
    learned = segmental_k_means(random_model("gaussian", 4, 2), sequences, max_iterations=200)
    assert len(learned.log_likelihoods) < 50
    assert learned.log_likelihoods[-1] - learned.log_likelihoods[-2] < 1e-4
    again = segmental_k_means(learned.model, sequences, max_iterations=1)
    for sequence in sequences:
        np.testing.assert_array_equal(
            decode(learned.model, sequence).path, decode(again.model, sequence).path
        )


@pytest.mark.parametrize("learn", [baum_welch, segmental_k_means])
def test_structural_zeros_and_exits_survive_learning(random_emission, learn):
    transition = np.array([[0.6, 0.4, 0.0], [0.0, 0.7, 0.3], [0.0, 0.0, 0.9]])
    model = Hmm(start_in(3), transition, random_emission("gaussian", 1, 3))
    sequences = [np.random.default_rng(k).normal(size=(15, 2)) for k in range(3)]
    learned = learn(model, sequences, max_iterations=5).model
    assert (learned.transition[transition == 0] == 0).all()
    np.testing.assert_allclose(learned.initial, model.initial, atol=1e-12)
    assert (learned.initial[1:] == 0).all()
    np.testing.assert_allclose(learned.transition.sum(axis=1), [1.0, 1.0, 0.9])


@pytest.mark.parametrize("learn", [baum_welch, segmental_k_means])
@pytest.mark.parametrize(
    "parts", [CHAIN, EMISSION, Parts(initial=False), Parts(False, True, False)]
)
def test_only_what_was_asked_for_is_learned(random_model, learn, parts):
    model = random_model("gaussian", 3, 3)
    learned = learn(model, sequences_of(random_model("gaussian", 7, 3), 1), learn=parts).model
    assert (learned.initial is not model.initial) == parts.initial
    assert (learned.transition is not model.transition) == parts.transition
    assert (learned.emission is not model.emission) == parts.emission


def test_learning_an_estimator_leaves_it_alone():
    rng = np.random.default_rng(0)
    model = Hmm(start_anywhere(3), fully_connected(3), Estimated(np.array([0.5, 0.3, 0.2])))
    learned = baum_welch(model, [rng.dirichlet(np.ones(3), 30)])
    assert learned.model.emission is model.emission
    assert learned.log_likelihoods[-1] > learned.log_likelihoods[0]


def test_an_unseen_symbol_costs_at_most_the_floor():
    start = Hmm(start_in(2), left_right(2, 0.1), Discrete(np.full((2, 4), 0.25), floor=0.01))
    learned = baum_welch(start, [np.array([0, 0, 1, 1])] * 3).model
    assert learned.emission.probabilities.min() == pytest.approx(0.01)
    assert evaluate(learned, np.array([0, 3, 1])) > -np.inf
    bare = start._replace(emission=Discrete(np.full((2, 4), 0.25)))
    learned = baum_welch(bare, [np.array([0, 0, 1, 1])] * 3).model
    with pytest.raises(ImpossibleSequenceError, match=r"observation 1 .*observed there: 3"):
        decode(learned, np.array([0, 3, 1]))


def test_learning_stops_at_the_tolerance(random_model):
    sequences = sequences_of(random_model("gaussian", 8, 2), 3)
    learned = baum_welch(
        random_model("gaussian", 4, 2), sequences, max_iterations=500, tolerance=1e-3
    )
    rises = np.diff(learned.log_likelihoods)
    assert rises[-1] < 1e-3
    assert (rises[:-1] >= 1e-3).all()


@pytest.mark.parametrize("learn", [baum_welch, segmental_k_means])
def test_sequences_end_in_their_end_states(random_emission, learn):
    model = Hmm(start_in(3), left_right(3, 0.3), random_emission("gaussian", 1, 3))
    rng = np.random.default_rng(4)
    sequences = [rng.normal(size=(4, 2)) for _ in range(6)]
    free = learn(model, sequences, max_iterations=1)
    ending = learn(model, sequences, max_iterations=1, end_states=[2])
    # A path to the end is one of all paths, so it is less likely than any.
    assert ending.log_likelihoods[0] < free.log_likelihoods[0]
    short = [rng.normal(size=(3, 2)), rng.normal(size=(3, 2))]
    certain = baum_welch(model, short, max_iterations=1, end_states=[2]).model
    np.testing.assert_allclose(certain.transition[:2], [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


GAUSSIAN = Hmm(start_in(3), left_right(3, 0.3), Gaussian(np.zeros((3, 2)), np.ones((3, 2))))
GOOD = np.random.default_rng(0).normal(size=(6, 2))
ONE_STILL = np.column_stack([GOOD[:, 0], np.ones(6)])


@pytest.mark.parametrize("learn", [baum_welch, segmental_k_means])
@pytest.mark.parametrize(
    ("sequences", "settings", "error", "says"),
    [
        ([], {}, ObservationError, "no sequences .*give at least one"),
        ([GOOD, GOOD[:0]], {}, ObservationError, "sequence 1: the sequence is empty"),
        ([GOOD, GOOD[:1]], {}, ObservationError, "sequence 1 has a single observation .*leave"),
        ([GOOD, GOOD * np.nan], {}, ObservationError, "sequence 1: observation 0 is nan"),
        ([GOOD, GOOD[:, :1]], {}, ObservationError, r"sequence 1: .*\(6, 1\).*\(T, 2\)"),
        ([np.ones((9, 2))], {}, ObservationError, "all 9 observations are equal"),
        (
            [GOOD, GOOD[:2]],
            {"end_states": [2]},
            ObservationError,
            "sequence 1 has 2 observations, but the model needs 3 to get to end state 2",
        ),
        ([GOOD], {"end_states": [3]}, ModelError, "end states"),
        ([GOOD], {"end_states": []}, ModelError, "end states"),
    ],
)
def test_bad_input_is_refused_with_its_place(learn, sequences, settings, error, says):
    with pytest.raises(error, match=says) as raised:
        learn(GAUSSIAN, sequences, **settings)
    assert isinstance(raised.value, UserError)


def test_a_still_dimension_needs_a_variance_floor():
    bare = GAUSSIAN._replace(emission=Gaussian(np.zeros((3, 2)), np.ones((3, 2)), 0.0))
    with pytest.raises(ObservationError, match="dimension 1 never varies"):
        baum_welch(bare, [ONE_STILL])
    learned = baum_welch(GAUSSIAN, [ONE_STILL], max_iterations=1).model
    np.testing.assert_allclose(learned.emission.variances[:, 1], 1e-6)


def test_a_single_observation_is_enough_where_no_transition_is_learned():
    learned = baum_welch(GAUSSIAN, [GOOD[:1], GOOD[1:2]], learn=EMISSION, max_iterations=1)
    np.testing.assert_allclose(learned.model.emission.means[0], GOOD[:2].mean(axis=0))


@pytest.mark.parametrize("learn", [baum_welch, segmental_k_means])
def test_an_impossible_sequence_is_named_with_step_and_symbol(learn):
    model = Hmm(start_in(2), left_right(2, 0.2), Discrete(np.array([[1.0, 0.0], [0.0, 1.0]])))
    with pytest.raises(ImpossibleSequenceError, match=r"sequence 1: .*observation 2 .*there: 0"):
        learn(model, [np.array([0, 1]), np.array([0, 1, 0, 1])])
