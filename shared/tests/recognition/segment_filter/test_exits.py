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
    told = exit_probability(DEFAULT_WEIGHTS, approach(8))
    assert (np.diff(told) >= 0).all()
    assert told[0] < 0.01 < 0.5 < told[-1]


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
    told = exit_probability(fit_exit(features, left), approach(12))
    assert told[:8].max() < 0.05
    assert told[-1] > 0.4


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
