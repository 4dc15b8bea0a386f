"""What directions tell of steps nobody sees: right on average, for steps that were drawn."""

from __future__ import annotations

import numpy as np
import pytest

from hmcs_laboratory.single_gestemes.step_errors import Spread, errors, fitted_spread

COUNT = 200_000


def drawn(
    dimensions: int, variance: float, backwards: float, outlier: float, count: int = COUNT
) -> tuple[np.ndarray, np.ndarray]:
    """Directions of steps y = v + √s Γ or their opposites, and the v of each."""
    rng = np.random.default_rng(5)
    expected = rng.normal(0, 1, (count, dimensions))
    expected /= np.linalg.norm(expected, axis=1, keepdims=True) / rng.uniform(0.5, 1.0, (count, 1))
    steps = expected + np.sqrt(variance) * rng.normal(size=expected.shape)
    steps *= np.where(rng.uniform(size=(count, 1)) < backwards, -1.0, 1.0)
    nothing = rng.uniform(size=count) < outlier
    steps[nothing] = rng.normal(size=(int(nothing.sum()), dimensions))
    return steps / np.linalg.norm(steps, axis=1, keepdims=True), expected


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("variance", [0.01, 0.2, 1.0])
@pytest.mark.parametrize("backwards", [0.0, 0.1])
def test_errors_are_right_on_average(dimensions: int, variance: float, backwards: float) -> None:
    direction, expected = drawn(dimensions, variance, backwards, 0.0)
    found = errors(direction, expected, np.full(COUNT, variance), backwards, 0.0)
    noise = 4.0 / np.sqrt(COUNT)
    assert found.square.mean() == pytest.approx(dimensions * variance, rel=0.02)
    np.testing.assert_allclose(found.mean.mean(axis=0), 0.0, atol=noise * (1 + np.sqrt(variance)))
    assert found.backwards.mean() == pytest.approx(backwards, abs=0.01)
    np.testing.assert_allclose(found.meant, 1.0)


def test_a_direction_that_tells_nothing_is_distinguished_from_one_that_does() -> None:
    direction, expected = drawn(2, 0.01, 0.0, 0.2)
    found = errors(direction, expected, np.full(COUNT, 0.01), 0.0, 0.2)
    assert found.meant.mean() == pytest.approx(0.8, abs=0.01)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_what_fits_best_is_what_the_steps_were_drawn_with(dimensions: int) -> None:
    direction, expected = drawn(dimensions, 0.05, 0.06, 0.01, 20_000)
    found = fitted_spread(
        direction, expected, Spread(0.3, 0.02, -np.inf), 0.01, least_variance=1e-6, iterations=40
    )
    assert found.variance == pytest.approx(0.05, rel=0.05)
    assert found.backwards == pytest.approx(0.06, abs=0.01)
    again = fitted_spread(direction, expected, found, 0.01, least_variance=1e-6, iterations=1)
    assert again.log_density >= found.log_density - 1e-9


def test_no_variance_falls_below_the_least_and_a_step_backwards_stays_possible() -> None:
    expected = np.tile([1.0, 0.0], (50, 1))
    found = fitted_spread(
        expected, expected, Spread(0.1, 0.02, -np.inf), 0.0, least_variance=0.03, iterations=9
    )
    assert found.variance == 0.03
    assert found.backwards == 1e-3
