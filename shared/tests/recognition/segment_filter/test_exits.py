"""The exit: learned where segments end, in steps, whatever the units and the frame."""

import numpy as np
import pytest

from hmcs.recognition.segment_filter.exits import (
    DEFAULT_WEIGHTS,
    HIGHEST,
    LOWEST,
    exit_features,
    exit_probability,
    fit_exit,
)


def approach(steps: int, past: int = 0) -> np.ndarray:
    """Features of a hand that walks straight over an end, `steps` before it to `past` after it."""
    left = np.arange(steps, -past - 1, -1.0)
    from_end = np.stack([-left, 0 * left], axis=1)
    normal = np.repeat([[1.0, 0.0]], len(left), axis=0)
    return exit_features(np.maximum(left, 0.0), from_end, normal, np.zeros_like(from_end))


def test_a_hand_that_nears_the_end_is_ever_more_likely_to_leave():
    reported = exit_probability(DEFAULT_WEIGHTS, approach(8))
    assert (np.diff(reported) >= 0).all()
    assert reported[0] < 0.01 < 0.5 < reported[-1]


def test_the_regression_agrees_with_scikit_learn():
    linear_model = pytest.importorskip("sklearn.linear_model")
    rng = np.random.default_rng(1)
    features = np.hstack([np.ones((400, 1)), rng.normal(size=(400, 9))])
    truth = rng.normal(size=10)
    left = rng.random(400) < 1 / (1 + np.exp(-features @ truth))
    theirs = linear_model.LogisticRegression(C=1 / 0.05, fit_intercept=False, tol=1e-10)
    np.testing.assert_allclose(
        fit_exit(features, left), theirs.fit(features, left).coef_[0], atol=1e-4
    )


def test_learned_exits_are_where_segments_ended():
    features = np.vstack([approach(12, past) for past in (0, 0, 1, 0, 1)])
    left = np.concatenate([np.arange(13 + past) == 12 + past for past in (0, 0, 1, 0, 1)])
    reported = exit_probability(fit_exit(features, left), approach(12))
    assert reported[:8].max() < 0.05
    assert reported[-1] > 0.4


def test_exits_are_never_quite_sure():
    features = 1e6 * np.array([[1.0] + [0.0] * 9, [-1.0] + [0.0] * 9])
    np.testing.assert_array_equal(exit_probability(DEFAULT_WEIGHTS, features), [HIGHEST, LOWEST])


def test_a_gesteme_of_hundreds_of_steps_is_not_left_by_chance():
    # However sure the regression is that it goes on, some is lost at every step.
    assert (1.0 - LOWEST) ** 500 > 0.9


def test_a_turn_is_a_sign_of_leaving_near_the_end_only():
    away = np.array([[1.0, 1.0]])

    def turn(steps_from_end: float) -> float:
        place = np.array([[-steps_from_end, 0.0]])
        return float(exit_features(np.ones(1), place, np.array([[1.0, 0.0]]), away)[0, 8])

    assert turn(2.5) == pytest.approx(turn(0.0) * np.exp(-0.5))
    assert turn(6.0) < 0.1 * turn(0.0)


def at(steps_past_the_end: float, turned_by: float = 0.0, remaining: float = 0.0) -> np.ndarray:
    """Features of a hand on the line through the end, which turns by so much in its last step."""
    place, normal = np.array([[steps_past_the_end, 0.0]]), np.array([[1.0, 0.0]])
    innovation = np.array([[np.cos(turned_by) - 1.0, np.sin(turned_by)]])
    return exit_features(np.array([remaining]), place, normal, innovation)


def test_a_hand_past_the_end_is_likelier_to_leave_than_one_as_far_short_of_it():
    for steps in (1.0, 2.0, 4.0):
        short, past = (exit_probability(DEFAULT_WEIGHTS, at(side * steps)) for side in (-1, 1))
        assert past > short + 0.1


def test_before_the_end_eight_steps_count_and_past_it_four():
    def line(place: float) -> float:
        return float(at(place)[0, 5])

    assert [line(place) for place in (-5.0, -1.0, 1.0, 3.0)] == [-5.0, -1.0, 1.0, 3.0]
    assert line(-8.0) == line(-50.0) < line(-7.0)
    assert line(4.0) == line(50.0) > line(3.5)
    # What is far on either side can be distinguished from what is near, whatever the side.
    assert at(-3.0)[0, 6] == at(3.0)[0, 6] > at(1.0)[0, 6] > 0


def test_turning_right_round_is_the_largest_turn():
    turns = [float(at(0.0, angle)[0, 8]) for angle in (0.0, 0.5, 1.0, 2.0, np.pi)]
    assert (np.diff(turns) > 0).all()
    farther = exit_features(np.zeros(1), np.zeros((1, 2)), np.eye(2)[:1], np.array([[-3.0, 0.0]]))
    assert farther[0, 8] == pytest.approx(turns[-1])


def test_a_hand_that_went_on_after_all_is_soon_believed_to():
    # However sure the regression is that it leaves, three nats of evidence make up for it.
    assert -np.log(1.0 - HIGHEST) < 3.1


def test_the_regression_finds_its_optimum_also_where_one_line_parts_the_examples():
    features = np.vstack([approach(12) for _ in range(30)])
    left = np.tile(np.arange(13) == 12, 30)
    weights = fit_exit(features, left)
    p = 1 / (1 + np.exp(-features @ weights))
    np.testing.assert_allclose(features.T @ (left - p), 0.05 * weights, atol=1e-6)


def test_more_than_eight_steps_left_are_no_more_than_eight():
    for left, counted in ((0.0, 0.0), (4.0, 4.0), (8.0, 8.0), (300.0, 8.0)):
        line, square = at(-1.0, remaining=left)[0, 3:5]
        assert (line, square) == (counted, pytest.approx(counted**2 / 8.0))


def test_a_turn_past_the_end_and_one_short_of_it_count_oppositely():
    for place in (-2.0, 1.0):
        features = at(place, 1.0)[0]
        assert features[9] == pytest.approx(0.25 * place * features[8])
    assert at(0.0, 1.0)[0, 9] == 0.0
