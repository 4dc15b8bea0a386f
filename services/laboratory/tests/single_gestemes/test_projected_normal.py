"""The projected normal density integrates to one, and its moments are its derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs_laboratory.single_gestemes.projected_normal import lengths, log_density

VARIANCES = [1e-8, 1e-6, 1e-4, 5e-4, 1e-3, 1.2e-3, 1e-2, 0.1, 1.0, 30.0, 1e4]


def angles(variance: float, size: float) -> np.ndarray:
    """From 0 to π, dense where the density rises."""
    width = min(np.sqrt(variance) / max(size, 1e-3), 1.0)
    return width * np.sinh(np.linspace(0.0, np.arcsinh(np.pi / width), 40_001))


def density(angle: np.ndarray, dimensions: int, size: float, variance: float) -> np.ndarray:
    """Of directions at these angles from the mean, which has this length."""
    directions = np.zeros((len(angle), dimensions))
    directions[:, 0], directions[:, 1] = np.cos(angle), np.sin(angle)
    means = np.tile(np.eye(dimensions)[0] * size, (len(angle), 1))
    return np.exp(log_density(directions, means, np.full(len(angle), variance)))


@pytest.mark.parametrize("size", [0.0, 0.3, 1.0, 5.0])
@pytest.mark.parametrize("variance", VARIANCES)
def test_the_density_integrates_to_one_in_the_plane_and_in_space(
    variance: float, size: float
) -> None:
    angle = angles(variance, size)
    in_plane = 2.0 * density(angle, 2, size, variance)
    in_space = 2.0 * np.pi * np.sin(angle) * density(angle, 3, size, variance)
    assert np.trapezoid(in_plane, angle) == pytest.approx(1.0, abs=1e-5)
    assert np.trapezoid(in_space, angle) == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("variance", [1e-2, 0.3, 10.0])
def test_directions_of_normal_vectors_are_as_dense_as_it_says(
    dimensions: int, variance: float
) -> None:
    rng = np.random.default_rng(3)
    mean = np.eye(dimensions)[0]
    drawn = mean + np.sqrt(variance) * rng.normal(size=(200_000, dimensions))
    angle = np.arccos(drawn[:, 0] / np.linalg.norm(drawn, axis=1))
    edges = np.linspace(0, np.pi, 13)
    seen = np.histogram(angle, edges)[0] / len(angle)
    fine = np.linspace(0, np.pi, 12_001)
    around = 2.0 if dimensions == 2 else 2.0 * np.pi * np.sin(fine)
    reported = around * density(fine, dimensions, 1.0, variance)
    expected = [
        np.trapezoid(reported[k : k + 1001], fine[k : k + 1001]) for k in range(0, 12_000, 1000)
    ]
    np.testing.assert_allclose(seen, expected, atol=4e-3)


@pytest.mark.parametrize("variance", VARIANCES)
@pytest.mark.parametrize("angle", [0.0, 1e-4, 0.3, 1.5, 2.0, np.pi])
@pytest.mark.parametrize("dimensions", [2, 3])
def test_lengths_are_the_derivatives_of_the_density(
    dimensions: int, angle: float, variance: float
) -> None:
    direction = np.zeros((1, dimensions))
    direction[0, :2] = np.cos(angle), np.sin(angle)
    mean = np.full((1, dimensions), 0.2)
    mean[0, 0] = 0.9

    def of(means: np.ndarray, s: float) -> float:
        return float(log_density(direction, means, np.array([s]))[0])

    found = lengths(direction, mean, np.array([variance]))
    # d log p / dv = (E[r] d − v) / s
    step = 1e-3 * max(np.sqrt(variance), 1e-3)
    for axis in range(dimensions):
        moved = step * np.eye(dimensions)[axis]
        slope = (of(mean + moved, variance) - of(mean - moved, variance)) / (2 * step)
        expected = (found.mean[0] * direction[0, axis] - mean[0, axis]) / variance
        assert slope == pytest.approx(expected, rel=2e-3, abs=2e-3 / np.sqrt(variance))
    # d log p / ds = (E|y − v|² / s − D) / 2s
    grown, shrunk = variance * 1.001, variance * 0.999
    slope = (of(mean, grown) - of(mean, shrunk)) / (grown - shrunk)
    square = found.square[0] - 2 * found.mean[0] * (direction @ mean[0])[0] + (mean**2).sum()
    expected = (square / variance - dimensions) / (2 * variance)
    assert slope == pytest.approx(expected, rel=2e-3, abs=2e-3 / variance)


def test_without_a_mean_all_directions_are_alike() -> None:
    directions = np.array([[1.0, 0, 0], [0, 0, -1.0]])
    reported = log_density(directions, np.zeros((2, 3)), np.array([1e-6, 1e3]))
    np.testing.assert_allclose(np.exp(reported), 1 / (4 * np.pi), rtol=1e-6)
    plane = log_density(directions[:1, :2], np.zeros((1, 2)), np.ones(1))
    np.testing.assert_allclose(np.exp(plane), 1 / (2 * np.pi), rtol=1e-6)


@settings(max_examples=200)
@given(
    st.floats(1e-12, 1e12),
    st.floats(0, 1e3),
    st.floats(0, np.pi),
    st.sampled_from([2, 3]),
)
def test_nothing_overflows(variance: float, size: float, angle: float, dimensions: int) -> None:
    direction = np.zeros((1, dimensions))
    direction[0, :2] = np.cos(angle), np.sin(angle)
    arguments = direction, np.eye(dimensions)[:1] * size, np.array([variance])
    mean, square = lengths(*arguments)
    assert np.isfinite(log_density(*arguments)).all()
    assert mean[0] > 0
    # No variance is below zero.
    assert square[0] >= mean[0] ** 2 * (1 - 1e-6)
