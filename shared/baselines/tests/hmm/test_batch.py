"""Many models learned at once equal each learned by itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.recognition.hmm.emissions import Discrete, Gaussian, ModelError, ObservationError
from hmcs.recognition.hmm.inference import ImpossibleSequenceError
from hmcs.recognition.hmm.learning import ALL, CHAIN, EMISSION, baum_welch
from hmcs.recognition.hmm.model import Hmm, sample
from hmcs.recognition.hmm.topologies import left_right, start_in
from hmcs_baselines.hmm.batch import baum_welch_many


def parameters(model):
    emission = model.emission
    chain = [model.initial, model.transition]
    if isinstance(emission, Gaussian):
        return [*chain, emission.means, emission.variances]
    return [*chain, emission.probabilities]


def assert_equal_one_by_one(models, sequences, **settings):
    together = baum_welch_many(models, sequences, **settings)
    for model, own, learned in zip(models, sequences, together, strict=True):
        alone = baum_welch(model, own, **settings)
        np.testing.assert_allclose(
            learned.log_likelihoods, alone.log_likelihoods, rtol=1e-9, atol=1e-9
        )
        for one, other in zip(parameters(learned.model), parameters(alone.model), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)
    return together


@pytest.fixture(scope="session")
def work(random_model):
    """A function of a seed and a kind: models, and of each some sequences of some lengths."""

    def make(seed, kind, count=4):
        rng = np.random.default_rng([seed, 5])
        models = [random_model(kind, seed + m, 3) for m in range(count)]
        sequences = [
            [
                sample(random_model(kind, seed + m + 77, 3), int(n), rng).observations
                for n in rng.integers(4, 25, size=rng.integers(1, 5))
            ]
            for m in range(count)
        ]
        return models, sequences

    return make


@given(
    seed=st.integers(0, 10_000),
    kind=st.sampled_from(["discrete", "gaussian"]),
    learn=st.sampled_from([ALL, CHAIN, EMISSION]),
)
@settings(max_examples=15)
def test_together_equals_one_by_one(work, seed, kind, learn):
    assert_equal_one_by_one(*work(seed, kind), learn=learn, max_iterations=6, tolerance=-np.inf)


def test_each_model_stops_by_itself(work):
    together = assert_equal_one_by_one(*work(3, "discrete", 6), max_iterations=40, tolerance=0.05)
    assert len({len(learned.log_likelihoods) for learned in together}) > 1


def test_floors_of_each_model_are_its_own(work):
    models, sequences = work(4, "discrete")
    models = [
        model._replace(emission=Discrete(model.emission.probabilities, 0.02 * m))
        for m, model in enumerate(models)
    ]
    together = assert_equal_one_by_one(models, sequences, max_iterations=6, tolerance=-np.inf)
    assert together[3].model.emission.probabilities.min() == pytest.approx(0.06)


def test_left_right_models_with_exits_keep_their_zeros():
    rng = np.random.default_rng(6)
    chain = start_in(4), left_right(4, 0.3, skip=0.2, leaves=True)
    models = [Hmm(*chain, Gaussian(rng.normal(size=(4, 2)), np.ones((4, 2)))) for _ in range(3)]
    sequences = [[rng.normal(size=(n, 2)) for n in (3, 20, 9)] for _ in models]
    for learned in assert_equal_one_by_one(models, sequences, max_iterations=5):
        assert (learned.model.transition[chain[1] == 0] == 0).all()


def test_sequences_far_from_the_model_are_learned_exactly():
    # Sharp Gaussians far off: what is reachable lies more than exp(−1000) below what is not.
    rng = np.random.default_rng(7)
    chain = start_in(3), left_right(3, 0.3)
    models = [
        Hmm(*chain, Gaussian(10.0 * np.arange(3)[:, None] + shift, np.full((3, 1), 0.05)))
        for shift in (0.0, 5.0)
    ]
    sequences = [
        [np.concatenate([rng.normal(10.0 * k, 1.0, (5, 1)) for k in order]) for order in orders]
        for orders in ([(0, 1, 2), (2, 1, 0)], [(2, 2, 1), (0, 1, 2)])
    ]
    assert_equal_one_by_one(models, sequences, max_iterations=4, tolerance=-np.inf)


def test_a_path_that_underflows_and_comes_back_is_not_lost():
    # After the first observation one state is below the smallest double; after the second the
    # other is nearly as improbable, and the first counts again.
    apart = np.sqrt(2 * 746.0)
    there = (740.0 + apart**2 / 2) / apart
    means = np.array([[0.0], [apart]])
    model = Hmm(np.array([0.5, 0.5]), np.eye(2), Gaussian(means, np.ones((2, 1))))
    (learned,) = assert_equal_one_by_one(
        [model], [[np.array([[0.0], [there]])]], max_iterations=1, tolerance=-np.inf
    )
    assert learned.model.initial[1] == pytest.approx(1 / (1 + np.exp(6.0)))


def test_integers_are_as_good_as_floats_for_gaussians():
    chain = start_in(2), left_right(2, 0.3)
    models = [Hmm(*chain, Gaussian(np.array([[0.0], [5.0]]), np.ones((2, 1))))]
    whole, broken = np.array([[0], [1], [5]]), np.array([[0.25], [4.5], [5.75]])
    assert_equal_one_by_one(models, [[whole, broken]], max_iterations=3)


def test_no_models_learn_nothing():
    assert baum_welch_many([], []) == ()


def test_bad_input_names_the_model_and_the_sequence(work):
    models, sequences = work(1, "gaussian")
    with pytest.raises(ObservationError, match="4 models but lists of sequences for 3"):
        baum_welch_many(models, sequences[:3])
    with pytest.raises(ObservationError, match="model 1: no sequences"):
        baum_welch_many(models, [sequences[0], [], *sequences[2:]])
    broken = [*sequences[:2], [*sequences[2], sequences[2][0] * np.nan], sequences[3]]
    with pytest.raises(ObservationError, match=r"model 2: sequence \d+: observation 0 is nan"):
        baum_welch_many(models, broken)
    with pytest.raises(ObservationError, match="model 0: all 5 observations are equal"):
        baum_welch_many(models, [[np.ones((5, 2))], *sequences[1:]])


def test_models_of_different_shape_are_refused(work, random_model):
    models, sequences = work(1, "gaussian")
    other = random_model("gaussian", 0, 4)
    with pytest.raises(ModelError, match="model 1 has Gaussian emissions of shape"):
        baum_welch_many([models[0], other], [sequences[0], sequences[1]])


def test_an_impossible_sequence_names_model_sequence_step_and_symbol():
    model = Hmm(start_in(2), left_right(2, 0.2), Discrete(np.array([[1.0, 0.0], [0.0, 1.0]])))
    good, bad = np.array([0, 1]), np.array([0, 1, 0, 1])
    with pytest.raises(
        ImpossibleSequenceError, match=r"model 1: sequence 1: .*observation 2 .*there: 0"
    ):
        baum_welch_many([model, model], [[good], [good, bad]])


def test_a_variance_that_vanishes_names_its_model():
    chain = start_in(2), left_right(2, 0.3)
    means = np.array([[0.0], [50.0]])
    models = [Hmm(*chain, Gaussian(means, np.ones((2, 1)), 0.0)) for _ in range(2)]
    fine = [np.array([[0.0], [1.0], [49.0], [50.0]])]
    collapsing = [np.array([[0.0], [1.0], [50.0], [50.0]])]
    with pytest.raises(ModelError, match="model 1: the variance of state 1"):
        baum_welch_many(models, [fine, collapsing], max_iterations=3)
