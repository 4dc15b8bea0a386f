"""The worked examples of thesis 2.1: weather, three coins, and counts of operations."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest

from hmcs.recognition.hmm.emissions import Discrete, ModelError
from hmcs.recognition.hmm.inference import forward
from hmcs.recognition.hmm.learning import baum_welch
from hmcs.recognition.hmm.model import Hmm, decode, evaluate, posterior, sample, validate
from hmcs.recognition.hmm.topologies import left_right, start_in
from hmcs_baselines.hmm.markov import (
    enumeration_operations,
    forward_operations,
    log_probability,
    markov_model,
    mean_stay_steps,
    predict,
    stationary,
)

SUNNY, CLOUDY, RAINING = range(3)
WEATHER = [[0.8, 0.15, 0.05], [0.2, 0.5, 0.3], [0.05, 0.5, 0.45]]
HEAD, TAIL = range(2)
FAIR, SECOND, THIRD = [0.5, 0.5], [0.33, 0.67], [0.2, 0.8]


def coins(second):
    """The fair coin, then the other: the first approach of the text."""
    chain = np.array([[50 / 51, 1 / 51], [0, 1]])
    return validate(Hmm(np.array([1.0, 0]), chain, Discrete(np.array([FAIR, second]))))


def three_coins(switch=1 / (51 * 2)):
    chain = np.array([[50 / 51, switch, switch], [0, 1, 0], [0, 0, 1]])
    emission = Discrete(np.array([FAIR, SECOND, THIRD]))
    return validate(Hmm(np.array([1.0, 0, 0]), chain, emission))


def tosses(rng, *shares):
    """Tosses of coins one after another, each given as (P(head), number of tosses)."""
    parts = [np.where(rng.random(n) < head, HEAD, TAIL) for head, n in shares]
    return np.concatenate(parts)


def test_the_weather_of_a_week_after_a_sunny_day():
    model = markov_model([1, 0, 0], WEATHER)
    week = [SUNNY, SUNNY, SUNNY, CLOUDY, RAINING, RAINING, CLOUDY, SUNNY]
    expected = 0.8 * 0.8 * 0.15 * 0.3 * 0.45 * 0.5 * 0.2
    assert np.exp(log_probability(model, week)) == pytest.approx(expected)


def test_the_weather_settles_to_what_the_balance_of_its_changes_gives():
    model = markov_model([1, 0, 0], WEATHER)
    # What enters each kind of weather leaves it again, solved by hand in exact numbers.
    expected = [Fraction(50, 121), Fraction(43, 121), Fraction(28, 121)]
    A = [[Fraction(str(p)) for p in row] for row in WEATHER]
    assert [sum(expected[i] * A[i][j] for i in range(3)) for j in range(3)] == expected
    np.testing.assert_allclose(stationary(model), [float(p) for p in expected])
    np.testing.assert_allclose(predict(model, [0, 0, 1], 200), stationary(model))


def test_the_weather_stays_sunny_for_five_days_in_the_mean():
    np.testing.assert_allclose(mean_stay_steps(markov_model([1, 0, 0], WEATHER)), [5, 2, 1 / 0.55])


def test_two_coins_cost_ten_to_the_32_by_enumeration_and_400_by_the_forward_recursion():
    assert len(str(enumeration_operations(2, 100))) == 33
    assert forward_operations(2, 100) == 400


def test_evaluation_is_the_sum_over_all_state_sequences():
    model = three_coins()
    seen = tosses(np.random.default_rng(0), (0.5, 4), (0.33, 4))
    B = model.emission.probabilities
    total = 0.0
    for path in product(range(3), repeat=len(seen)):
        chain = markov_model(model.initial, model.transition)
        total += np.exp(log_probability(chain, path)) * B[list(path), seen].prod()
    assert evaluate(model, seen) == pytest.approx(np.log(total))


def test_the_printed_matrix_of_three_coins_is_none_and_the_corrected_one_is():
    with pytest.raises(ModelError, match="transition row 0"):
        three_coins(1 / 51.2)
    np.testing.assert_allclose(three_coins().transition.sum(axis=1), 1.0)


@pytest.mark.parametrize("head", [0.33, 0.2])
def test_both_approaches_name_the_same_coin(head):
    """The three-state model holds half of each two-state model once the fair coin is left."""
    rng = np.random.default_rng(1)
    for _ in range(25):
        seen = tosses(rng, (0.5, 50), (head, 50))
        by_model = [evaluate(coins(second), seen) for second in (SECOND, THIRD)]
        ends = posterior(three_coins(), seen).states[-1]
        assert (by_model[0] > by_model[1]) == (ends[1] > ends[2])

        left = []
        for second in (SECOND, THIRD):
            model = coins(second)
            log_emission = model.emission.log_likelihood(seen)
            left.append(forward(model.initial, model.transition, log_emission)[-1, 1])
        assert np.log(ends[1] / ends[2]) == pytest.approx(left[0] - left[1])


@pytest.mark.long
def test_the_coin_is_named_as_often_as_the_tosses_allow():
    """Nobody does better than who knows the 50 tosses of the other coin; the model comes close."""
    rng = np.random.default_rng(2)
    right, best, trials = 0, 0, 400
    for trial in range(trials):
        is_third = trial % 2 == 1
        seen = tosses(rng, (0.5, 50), (THIRD[HEAD] if is_third else SECOND[HEAD], 50))
        right += (evaluate(coins(THIRD), seen) > evaluate(coins(SECOND), seen)) == is_third
        logs = [np.log(coin)[seen[50:]].sum() for coin in (SECOND, THIRD)]
        best += (logs[1] > logs[0]) == is_third
    assert 0.8 * trials < right <= best + 0.02 * trials
    assert best - right < 0.06 * trials


def test_the_most_probable_coins_are_tossed_in_one_order():
    for seed in range(10):
        rng = np.random.default_rng(seed)
        path = decode(three_coins(), tosses(rng, (0.5, 50), (0.2, 50))).path
        assert path[0] == 0
        assert np.count_nonzero(np.diff(path)) <= 1


@pytest.mark.parametrize("seed", range(8))
def test_two_unknown_coins_and_the_change_between_them_are_learned(seed):
    rng = np.random.default_rng(seed)
    heads, change = (0.85, 0.25), int(rng.integers(80, 220))
    seen = tosses(rng, (heads[0], change), (heads[1], 300 - change))
    guess = Discrete(np.array([[0.6, 0.4], [0.4, 0.6]]))
    start = Hmm(start_in(2), left_right(2, 0.05), guess)
    learned = baum_welch(start, [seen], max_iterations=200, tolerance=1e-9).model
    assert (learned.transition[[1, 1], [0, 1]] == [0, 1]).all()

    found = int(np.argmax(decode(learned, seen).path))
    assert abs(found - change) <= 10
    shares = [np.mean(seen[:found] == HEAD), np.mean(seen[found:] == HEAD)]
    np.testing.assert_allclose(learned.emission.probabilities[:, HEAD], shares, atol=0.03)
    truth = Hmm(start.initial, left_right(2, 1 / (change + 1)), Discrete(_coins(heads)))
    assert evaluate(learned, seen) >= evaluate(truth, seen)


def test_sampled_tosses_leave_the_fair_coin_after_51_in_the_mean():
    rng = np.random.default_rng(3)
    changes = [int(np.argmax(sample(coins(SECOND), 600, rng).path)) for _ in range(200)]
    assert np.mean(changes) == pytest.approx(51, abs=4 * 51 / np.sqrt(200))


def _coins(heads):
    return np.array([[head, 1 - head] for head in heads])
