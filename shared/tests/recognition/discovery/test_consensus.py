"""The mean of performances: where each passes it, from its beginning to its end."""

from __future__ import annotations

import numpy as np
import pytest

from hmcs.recognition.discovery.consensus import consensus, equal_steps

STEP_M = 0.01


def shown(seed: int, pace: float) -> np.ndarray:
    """Round a corner, slower or faster in its second half, in equal steps."""
    rng = np.random.default_rng(seed)
    share = np.linspace(0, 1, 200) ** pace
    x, y = np.minimum(2 * share, 1), np.maximum(2 * share - 1, 0)
    path = 0.3 * np.stack([x, y, 0 * x], axis=1) + rng.normal(0, 2e-4, (200, 3))
    return equal_steps(path - path[0], STEP_M)[0]


@pytest.mark.parametrize("count", [2, 3, 6])
def test_every_performance_passes_the_mean_from_its_first_to_its_last_step(count: int) -> None:
    performances = [shown(seed, 0.8 + 0.1 * seed) for seed in range(count)]
    found = consensus(performances, STEP_M)
    for performance, at in zip(performances, found.at, strict=True):
        assert at[0] == 0.0
        assert at[-1] == len(performance) - 1
        assert (np.diff(at) >= 0).all()


def test_the_mean_of_equal_performances_is_what_they_are() -> None:
    performance = shown(0, 1.0)
    found = consensus([performance] * 3, STEP_M)
    np.testing.assert_allclose(found.path[-1], performance[-1], atol=1e-3)
    assert found.variance == pytest.approx(0.0, abs=1e-9)
    near = np.linalg.norm(found.path[:, None] - performance[None], axis=2).min(axis=1)
    assert near.max() < STEP_M
