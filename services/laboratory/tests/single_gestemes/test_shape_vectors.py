"""Motions as vectors: known answers, and what varies in them as it is said to vary."""

from __future__ import annotations

import numpy as np
import pytest

from hmcs_laboratory.single_gestemes.shape_vectors import (
    HandSettings,
    beginning_vector,
    expected_covariance,
    roughness,
    whole_vector,
)

STILL = HandSettings(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
LINE = np.linspace([0.0, 0.0], [12.0, 0.0], 13)


@pytest.mark.parametrize("deviation", [0.01, 0.1])
@pytest.mark.parametrize("dimensions", [2, 3])
def test_roughness_is_the_deviation_of_directions_an_axis(
    deviation: float, dimensions: int
) -> None:
    rng = np.random.default_rng(0)
    moves = np.zeros((20_000, dimensions))
    moves[:, 0] = 1.0
    moves[:, 1:] = rng.normal(0, deviation, (20_000, dimensions - 1))
    motion = np.vstack([np.zeros(dimensions), np.cumsum(moves, axis=0)])
    # Along the line nothing varies: of D axes D − 1 do.
    expected = deviation * np.sqrt((dimensions - 1) / dimensions)
    assert roughness([motion]) == pytest.approx(expected, rel=0.05)


def test_a_smooth_curve_and_a_motion_of_few_steps_are_not_rough() -> None:
    angle = np.linspace(0, 1, 200)
    assert roughness([np.stack([np.cos(angle), np.sin(angle)], axis=1)]) < 1e-4
    assert roughness([LINE[:4]]) == 0.0


def test_steps_backwards_are_no_turns() -> None:
    there_and_back = np.vstack([LINE, LINE[-2::-1]])
    assert roughness([there_and_back]) == pytest.approx(0.0, abs=1e-9)


def test_vectors_are_places_along_the_motion() -> None:
    np.testing.assert_allclose(whole_vector(LINE, 3), [4, 0, 8, 0, 12, 0, np.log(12)])
    np.testing.assert_allclose(beginning_vector(LINE, 6, 2), [3, 0, 6, 0])
    # One that is over before stays where it ended.
    np.testing.assert_allclose(beginning_vector(LINE, 24, 2), [12, 0, 12, 0])


def test_size_turn_and_length_vary_as_they_are_said_to() -> None:
    rng = np.random.default_rng(1)
    settings = STILL._replace(size=0.05, turn_rad=0.04, log_length=0.2)
    found = expected_covariance([LINE], 4, settings, whole=True)
    vectors = []
    for _ in range(5_000):
        angle = rng.normal(0, 0.04)
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        vectors.append(whole_vector(LINE @ turn * (1 + rng.normal(0, 0.05)), 4))
    expected = np.cov(np.array(vectors).T)
    np.testing.assert_allclose(found[:-1, :-1], expected[:-1, :-1], atol=0.04)
    assert found[-1, -1] == pytest.approx(0.2**2)


def test_the_hand_drifts_farther_the_longer_it_goes() -> None:
    found = expected_covariance([LINE], 4, STILL._replace(drift=0.1), whole=False)
    # A random walk: the variance grows with the way.
    np.testing.assert_allclose(np.diag(found)[::2], (0.1 * 12) ** 2 * np.arange(1, 5) / 4)


@pytest.mark.parametrize("whole", [True, False])
def test_what_is_expected_is_a_covariance(whole: bool) -> None:
    rng = np.random.default_rng(2)
    motions = [LINE + rng.normal(0, 0.1, LINE.shape) for _ in range(3)]
    found = expected_covariance(motions, 5, HandSettings(), whole=whole)
    np.testing.assert_allclose(found, found.T)
    assert np.linalg.eigvalsh(found).min() > -1e-9 * np.linalg.eigvalsh(found).max()
