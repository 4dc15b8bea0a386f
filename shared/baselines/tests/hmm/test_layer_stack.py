"""Layered models against the forward filter, evaluation of windows, and every symbol sequence."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.recognition.hmm.emissions import Discrete, Gaussian, ModelError, ObservationError
from hmcs.recognition.hmm.inference import ImpossibleSequenceError, forward, log_filtered
from hmcs.recognition.hmm.learning import CHAIN, baum_welch
from hmcs.recognition.hmm.log_transitions import LogTransitions
from hmcs.recognition.hmm.model import Hmm, evaluate
from hmcs_baselines.hmm.layer_stack import Layer, LayerError, LayerStackFilter, run
from hmcs_baselines.hmm.markov import MarkovModelError
from hmcs_baselines.hmm.soft_evidence import SoftSymbols, learn_task


def chain(rng, states):
    return rng.dirichlet(np.ones(states)), rng.dirichlet(np.ones(states), size=states)


def gaussian(rng, states):
    means, variances = rng.normal(size=(states, 2)), rng.uniform(0.3, 2, size=(states, 2))
    return Hmm(*chain(rng, states), Gaussian(means, variances))


def discrete(rng, states, symbols):
    return Hmm(*chain(rng, states), Discrete(rng.dirichlet(np.ones(symbols), size=states)))


def only(symbol, symbols):
    """A model of one state that emits one symbol and nothing else."""
    return Hmm(np.ones(1), np.ones((1, 1)), Discrete(np.eye(symbols)[[symbol]]))


def posterior(prior, models, observations):
    logs = np.log(prior) + [evaluate(model, observations) for model in models]
    weights = np.exp(logs - max(logs))
    return weights / weights.sum()


def filtered(model, observations):
    """P(state | observations so far) of one model alone, shape (T, N)."""
    log_emission = model.emission.log_likelihood(observations)
    return np.exp(
        log_filtered(model.initial, LogTransitions(model.transition), log_emission).log_states
    )


@given(seed=st.integers(0, 10_000), states=st.integers(1, 4))
@settings(max_examples=15)
def test_one_layer_of_one_model_is_the_forward_filter(seed, states):
    rng = np.random.default_rng(seed)
    model, observations = gaussian(rng, states), rng.normal(size=(20, 2))
    beliefs = run([Layer((model,))], observations)
    expected = filtered(model, observations)
    np.testing.assert_allclose(
        [belief.classification for (belief,) in beliefs], expected, atol=1e-12
    )


@given(seed=st.integers(0, 10_000), window=st.one_of(st.none(), st.integers(1, 6)))
@settings(max_examples=20)
def test_models_in_parallel_are_as_probable_as_their_window_makes_them(seed, window):
    rng = np.random.default_rng(seed)
    models = tuple(gaussian(rng, states) for states in (1, 3, 2))
    prior = rng.dirichlet(np.ones(3))
    observations = rng.normal(size=(12, 2))
    beliefs = run([Layer(models, window=window, prior=prior)], observations)
    for t, (belief,) in enumerate(beliefs):
        first = 0 if window is None else max(0, t + 1 - window)
        seen = observations[first : t + 1]
        expected = posterior(prior, models, seen)
        np.testing.assert_allclose(belief.models, expected, atol=1e-10)
        for k, model in enumerate(models):
            log_alpha = forward(
                model.initial, model.transition, model.emission.log_likelihood(seen)
            )[-1]
            own = np.exp(log_alpha - np.logaddexp.reduce(log_alpha))
            np.testing.assert_allclose(belief.states[k], expected[k] * own, atol=1e-10)


@given(seed=st.integers(0, 10_000), passes=st.sampled_from(["winner", "distribution"]))
@settings(max_examples=10)
def test_every_layer_sums_to_one_after_every_step(seed, passes):
    rng = np.random.default_rng(seed)
    layers = [
        Layer(tuple(gaussian(rng, 2) for _ in range(4)), window=3, granularity=2, passes=passes),
        Layer(tuple(discrete(rng, 2, 4) for _ in range(3)), granularity=3, passes=passes),
        Layer((discrete(rng, 5, 3),)),
    ]
    outputs = [0, 0, 0]
    for beliefs in run(layers, rng.normal(size=(25, 2))):
        for number, (layer, belief) in enumerate(zip(layers, beliefs, strict=True)):
            assert sum(states.sum() for states in belief.states) == pytest.approx(1.0)
            assert belief.models.sum() == pytest.approx(1.0)
            assert belief.classification.shape == (layer.classes,)
            outputs[number] += belief.output is not None
    assert outputs == [12, 4, 4]


def test_winner_takes_all_equals_feeding_the_winning_symbols_by_hand():
    rng = np.random.default_rng(0)
    task = discrete(rng, 3, 4)
    layers = [Layer(tuple(only(k, 4) for k in range(4)), window=1), Layer((task,))]
    symbols = rng.integers(4, size=30)
    by_hand = filtered(task, symbols)
    tops = [beliefs[1].classification for beliefs in run(layers, symbols)]
    np.testing.assert_allclose(tops, by_hand, atol=1e-12)


@pytest.mark.parametrize("granularity", [1, 3])
def test_evidence_that_is_sure_makes_soft_and_winner_the_same(granularity):
    rng = np.random.default_rng(1)
    task = discrete(rng, 3, 4)

    def tops(passes):
        below = Layer(tuple(only(k, 4) for k in range(4)), 1, granularity, passes)
        symbols = np.repeat(np.random.default_rng(2).integers(4, size=10), granularity)
        return [beliefs[1].classification for beliefs in run([below, Layer((task,))], symbols)]

    np.testing.assert_array_equal(tops("winner"), tops("distribution"))


def test_soft_evidence_is_the_sum_over_every_symbol_sequence():
    rng = np.random.default_rng(3)
    below = Layer(tuple(gaussian(rng, 2) for _ in range(3)), window=2, passes="distribution")
    task = discrete(rng, 2, 3)
    beliefs = run([below, Layer((task,))], rng.normal(size=(4, 2)))
    outputs = [belief.output for belief, _ in beliefs]
    expected = np.zeros(2)
    for symbols in product(range(3), repeat=4):
        weight = np.prod([q[symbol] for q, symbol in zip(outputs, symbols, strict=True)])
        log_alpha = forward(
            task.initial, task.transition, task.emission.log_likelihood(np.array(symbols))
        )
        expected += weight * np.exp(log_alpha[-1])
    np.testing.assert_allclose(beliefs[-1][1].classification, expected / expected.sum())


def test_soft_evidence_that_is_undecided_leaves_the_prior_as_it_is():
    rng = np.random.default_rng(4)
    model = discrete(rng, 3, 2)
    same = gaussian(rng, 2)
    task = Hmm(model.initial, model.transition, Discrete(np.array([[1.0, 0], [0.5, 0.5], [0, 1]])))
    layers = [Layer((same, same), passes="distribution"), Layer((task,))]
    for t, beliefs in enumerate(run(layers, rng.normal(size=(5, 2)))):
        expected = task.initial @ np.linalg.matrix_power(task.transition, t)
        np.testing.assert_allclose(beliefs[1].classification, expected, atol=1e-12)


def test_granularity_passes_the_mean_of_classifications_and_its_winner():
    rng = np.random.default_rng(5)
    models = tuple(gaussian(rng, 2) for _ in range(3))
    observations = rng.normal(size=(9, 2))
    every = [b.classification for (b,) in run([Layer(models, window=2)], observations)]
    for passes in ("winner", "distribution"):
        layer = Layer(models, window=2, granularity=3, passes=passes)
        outputs = [belief.output for (belief,) in run([layer], observations)]
        for t, output in enumerate(outputs):
            if t % 3 != 2:
                assert output is None
                continue
            mean = np.mean(every[t - 2 : t + 1], axis=0)
            expected = mean if passes == "distribution" else np.eye(3)[mean.argmax()]
            np.testing.assert_allclose(output, expected)


def test_a_layer_that_nothing_reached_keeps_its_belief():
    rng = np.random.default_rng(6)
    task = discrete(rng, 3, 2)
    layers = [Layer((gaussian(rng, 2), gaussian(rng, 1)), granularity=2), Layer((task,))]
    tops = [b[1] for b in run(layers, rng.normal(size=(6, 2)))]
    np.testing.assert_allclose(tops[0].classification, task.initial)
    assert tops[2].output is None
    np.testing.assert_array_equal(tops[2].classification, tops[1].classification)
    assert not np.allclose(tops[3].classification, tops[1].classification)


def test_a_restarted_layer_is_as_new_and_the_others_go_on():
    rng = np.random.default_rng(7)
    layers = [
        Layer(tuple(gaussian(rng, 2) for _ in range(3)), granularity=2),
        Layer((discrete(rng, 3, 3),)),
    ]
    observations = rng.normal(size=(13, 2))
    restarted = run(layers, observations, {0: [5]})
    fresh = run(layers, observations[5:])
    for after, new in zip(restarted[5:], fresh, strict=True):
        np.testing.assert_array_equal(after[0].models, new[0].models)
        np.testing.assert_equal(after[0].output, new[0].output)

    task = layers[1].models[0]
    winners = [int(b[0].output.argmax()) for b in restarted if b[0].output is not None]
    by_hand = filtered(task, np.array(winners))
    np.testing.assert_allclose(restarted[-1][1].classification, by_hand[-1], atol=1e-12)


def test_reset_forgets_everything():
    rng = np.random.default_rng(8)
    layered = LayerStackFilter(
        [Layer((gaussian(rng, 2), gaussian(rng, 2))), Layer((discrete(rng, 2, 2),))]
    )
    observations = rng.normal(size=(4, 2))
    first = [layered.step(o)[1].classification for o in observations]
    layered.reset()
    again = [layered.step(o)[1].classification for o in observations]
    np.testing.assert_array_equal(first, again)


def test_an_impossible_window_is_named_and_leaves_the_filter_as_it_was():
    layered = LayerStackFilter([Layer((only(0, 3), only(1, 3)))])
    layered.step(0)
    with pytest.raises(ImpossibleSequenceError, match=r"layer 0.*observation 1 since") as raised:
        layered.step(1)
    assert raised.value.step == 1
    with pytest.raises(ObservationError):
        layered.step(3)
    np.testing.assert_array_equal(layered.step(0)[0].models, [1, 0])
    layered.restart(0)
    np.testing.assert_array_equal(layered.step(1)[0].models, [0, 1])


def test_a_model_that_makes_the_window_impossible_has_no_share_in_it():
    first, second = LayerStackFilter([Layer((only(0, 3), only(1, 3)))]).step(1)[0].states
    assert (first[0], second[0]) == (0.0, 1.0)


def test_observations_that_are_not_numbers_are_refused():
    rng = np.random.default_rng(9)
    layered = LayerStackFilter([Layer((gaussian(rng, 2),))])
    with pytest.raises(ObservationError):
        layered.step(np.array([0.0, np.nan]))


def test_layers_that_do_not_fit_together_are_refused():
    rng = np.random.default_rng(10)
    below = Layer((gaussian(rng, 2), gaussian(rng, 2)))
    with pytest.raises(LayerError, match="model 0 of layer 1 observes 3 symbols"):
        LayerStackFilter([below, Layer((discrete(rng, 2, 3),))])
    with pytest.raises(LayerError, match="Gaussian emission"):
        LayerStackFilter([below, Layer((gaussian(rng, 2),))])
    with pytest.raises(LayerError, match="no layers"):
        LayerStackFilter([])
    for number in (-1, 1):
        with pytest.raises(LayerError, match=f"no layer {number}"):
            LayerStackFilter([below]).restart(number)


@pytest.mark.parametrize(
    ("settings_of", "error", "message"),
    [
        ({"window": 0}, LayerError, "window 0"),
        ({"granularity": 0}, LayerError, "granularity 0"),
        ({"passes": "loser"}, LayerError, "'loser'"),
        ({"prior": np.array([0.5, 0.5])}, MarkovModelError, "prior"),
        ({"prior": np.array([0.5])}, MarkovModelError, "row 0 of the prior"),
    ],
)
def test_layers_out_of_range_are_refused(settings_of, error, message):
    with pytest.raises(error, match=message):
        Layer((only(0, 2),), **settings_of)


def test_a_layer_needs_models_that_are_models():
    with pytest.raises(LayerError, match="without a model"):
        Layer(())
    with pytest.raises(ModelError, match="transition row 0"):
        Layer((Hmm(np.ones(1), np.full((1, 1), 1.1), Discrete(np.eye(1))),))


def test_the_task_is_learned_by_counting_symbols_and_then_the_chain_alone():
    start = Hmm(
        np.array([1.0, 0, 0]),
        np.array([[0.5, 0.5, 0], [0, 0.5, 0.5], [0, 0, 1]]),
        Discrete(np.full((3, 4), 0.25)),
    )
    labels = [[0, 0, 0, 1, 1, 2, 2, 2], [0, 1, 1, 1, 1, 2, 2, 2]]
    symbols = [np.array([0, 0, 1, 1, 1, 2, 0, 2]), np.array([0, 1, 1, 3, 1, 2, 2, 2])]
    learned = learn_task(start, [np.eye(4)[s] for s in symbols], labels, floor=0.0)
    np.testing.assert_allclose(
        learned.emission.probabilities,
        [[3 / 4, 1 / 4, 0, 0], [0, 5 / 6, 0, 1 / 6], [1 / 6, 0, 5 / 6, 0]],
    )
    by_symbols = baum_welch(
        Hmm(start.initial, start.transition, learned.emission), symbols, learn=CHAIN
    ).model
    np.testing.assert_allclose(learned.transition, by_symbols.transition, atol=1e-12)
    np.testing.assert_allclose(learned.initial, by_symbols.initial, atol=1e-12)
    assert (learned.transition[start.transition == 0] == 0).all()

    floored = learn_task(start, [np.eye(4)[s] for s in symbols], labels, floor=0.01)
    assert floored.emission.probabilities.min() == pytest.approx(0.01)
    np.testing.assert_allclose(floored.emission.probabilities.sum(axis=1), 1.0)


def test_learning_from_soft_evidence_never_lowers_the_likelihood():
    rng = np.random.default_rng(11)
    evidence = [rng.dirichlet(np.full(4, 0.3), size=25) for _ in range(3)]
    model = discrete(rng, 3, 4)
    soft = Hmm(model.initial, model.transition, SoftSymbols(model.emission))
    learned = baum_welch(soft, evidence, max_iterations=15, tolerance=-np.inf)
    assert (np.diff(learned.log_likelihoods) > -1e-9).all()
    assert learned.log_likelihoods[-1] > learned.log_likelihoods[0] + 1


def test_learning_from_sure_evidence_is_learning_from_symbols():
    rng = np.random.default_rng(12)
    symbols = [rng.integers(4, size=20) for _ in range(3)]
    model = discrete(rng, 3, 4)
    soft = Hmm(model.initial, model.transition, SoftSymbols(model.emission))
    by_evidence = baum_welch(soft, [np.eye(4)[s] for s in symbols]).model
    by_symbols = baum_welch(model, symbols).model
    np.testing.assert_allclose(
        by_evidence.emission.symbols.probabilities, by_symbols.emission.probabilities, atol=1e-9
    )
    np.testing.assert_allclose(by_evidence.transition, by_symbols.transition, atol=1e-9)


@pytest.mark.parametrize(
    ("evidence", "labels", "error", "message"),
    [
        ([], [], ObservationError, "0 sequences"),
        ([np.eye(2)], [], ObservationError, "1 sequences of evidence and 0"),
        ([np.eye(2)], [[0]], ObservationError, "2 outputs and 1 labels"),
        ([np.eye(2)], [[0, 0]], ObservationError, "no label is state 1"),
        ([np.eye(2)], [[0, 2]], MarkovModelError, "step 1 of a state sequence is 2"),
        ([-np.eye(2)], [[0, 1]], ObservationError, "a distribution over 2 symbols"),
    ],
)
def test_evidence_that_does_not_fit_its_labels_is_refused(evidence, labels, error, message):
    start = Hmm(np.full(2, 0.5), np.full((2, 2), 0.5), Discrete(np.full((2, 2), 0.5)))
    with pytest.raises(error, match=message):
        learn_task(start, evidence, labels, floor=0.0)
