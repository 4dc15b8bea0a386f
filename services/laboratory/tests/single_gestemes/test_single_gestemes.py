"""One gesteme by itself: how probable it is that a motion goes on, and what each voice counts."""

from __future__ import annotations

import numpy as np
import pytest

from hmcs_laboratory.single_gestemes.learning import SingleSettings, learn_single, pool_weights
from hmcs_laboratory.single_gestemes.model import causal_scores, scores, voices


def line(steps: int, seed: int, heading_rad: float = 0.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    direction = heading_rad + rng.normal(0, 0.05, steps)
    moves = np.stack([np.cos(direction), np.sin(direction)], axis=1)
    return np.vstack([np.zeros(2), np.cumsum(moves, axis=0)])


def known(short: int, long: int, **changed: object):
    examples = [[line(short, k) for k in range(4)], [line(long, 9 + k) for k in range(4)]]
    return learn_single(examples, SingleSettings(rounds=0)._replace(**changed))


def test_a_beginning_longer_than_a_motion_ever_was_is_of_the_longer_one() -> None:
    # No points are compared of beginnings so short: the length alone tells.
    knowledge = known(4, 40, beginning_points=50)
    _, shape = voices(knowledge, [line(12, 99)], whole=False)
    assert shape[0, 1] > np.log(0.95)
    _, shape = voices(knowledge, [line(2, 99)], whole=False)
    np.testing.assert_allclose(np.exp(shape[0]), 0.5, atol=0.1)


def test_at_its_usual_length_half_of_all_motions_go_on() -> None:
    knowledge = known(10, 60, beginning_points=50)
    _, shape = voices(knowledge, [line(10, 99)], whole=False)
    # Of the long one all go on.
    assert np.exp(shape[0, 0]) == pytest.approx((1 / 2) / (1 + 1 / 2), abs=1e-3)


def test_lengths_spread_as_they_were_learned() -> None:
    knowledge = known(10, 20, beginning_points=500)
    lengths = np.log([10.0, 1e9])
    shapes = knowledge.shapes._replace(log_length=lengths, log_length_deviation=0.4)
    knowledge = knowledge._replace(shapes=shapes)
    steps = np.unique(np.geomspace(1, 200, 60).round())
    reported = [voices(knowledge, [line(int(n), 99)], whole=False)[1][0] for n in steps]
    # P(longer than n) of the short one, from the odds against the one of which all go on.
    survival = np.array([np.exp(short - long) for short, long in reported])
    mass = -np.diff(survival, prepend=1.0)
    log_length = np.log(steps)
    mean = (mass * log_length).sum() / mass.sum()
    deviation = np.sqrt((mass * (log_length - mean) ** 2).sum() / mass.sum())
    assert deviation == pytest.approx(0.4, abs=0.04)


def test_where_voices_tell_nothing_their_weights_stay_as_usual() -> None:
    undecided = np.full((2, 6, 3), -np.log(3))
    labels = np.array([0, 1, 2, 0, 1, 2])
    np.testing.assert_allclose(pool_weights([undecided], labels, (0.5, 0.3), 0.7), [0.5, 0.3])


def test_a_voice_that_is_right_gains_weight_and_one_that_is_wrong_loses_it() -> None:
    labels = np.arange(30) % 3
    right = np.full((30, 3), np.log(0.1))
    right[np.arange(30), labels] = np.log(0.8)
    wrong = np.full((30, 3), np.log(0.1))
    wrong[np.arange(30), (labels + 1) % 3] = np.log(0.8)
    heard, unheard = pool_weights([np.stack([right, wrong])], labels, (0.5, 0.5), 0.7)
    assert unheard < 0.5 < heard


def test_seen_step_by_step_it_is_what_the_part_alone_says() -> None:
    examples = [[line(20, k, turn) for k in range(3)] for turn in (0.0, 0.6)]
    knowledge = learn_single(examples)
    motion = line(20, 50, 0.6)
    rows = causal_scores(knowledge, motion)
    for sample in (0, 1, 7, 15, 20):
        np.testing.assert_allclose(
            rows[sample], scores(knowledge, motion[: sample + 1], whole=False), atol=1e-9
        )
    assert scores(knowledge, motion, whole=True).argmax() == 1
    np.testing.assert_allclose(np.exp(rows).sum(axis=1), 1.0)
