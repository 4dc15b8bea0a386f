"""The mean path is the minimum it is said to be, and leads where it says."""

from __future__ import annotations

import numpy as np
import pytest

from hmcs_laboratory.single_gestemes.even_points import evenly
from hmcs_laboratory.single_gestemes.mean_paths import ahead, normals, padded, smoothed_mean_path

CORNER = np.vstack([np.linspace([0, 0], [9, 0], 10), np.linspace([9, 0], [9, 9], 10)[1:]]).astype(
    float
)


def smoothest(performances: list[np.ndarray], smoothing: float) -> np.ndarray:
    """By least squares: near the performances, with small second differences, begun at 0."""
    samples = round(np.mean([len(p) for p in performances]))
    rows, wanted = [], []
    for performance in performances:
        points = evenly(performance, samples)
        for k in range(samples):
            weight = np.sqrt(1e6 if k == 0 else 3.0 if k == samples - 1 else 1.0)
            rows.append(weight * np.eye(samples)[k])
            wanted.append(weight * points[k])
    for k in range(samples - 2):
        bend = np.zeros(samples)
        bend[k : k + 3] = 1.0, -2.0, 1.0
        rows.append(np.sqrt(smoothing) * bend)
        wanted.append(np.zeros(2))
    return np.linalg.lstsq(np.array(rows), np.array(wanted), rcond=None)[0]


@pytest.mark.parametrize("smoothing", [0.0, 3.0, 300.0])
def test_the_mean_path_is_the_least_of_what_it_weighs(smoothing: float) -> None:
    rng = np.random.default_rng(0)
    shown = [CORNER + rng.normal(0, 0.2, CORNER.shape) * (np.arange(19) > 0)[:, None] for _ in "ab"]
    nodes = smoothed_mean_path(shown, 0.01, smoothing)
    expected = smoothest(shown, smoothing)
    np.testing.assert_allclose(nodes[0], 0.0, atol=1e-9)
    np.testing.assert_allclose(nodes[-1], expected[-1] - expected[0], atol=1e-3)
    # Every one of its samples lies on the way through the nodes.
    for point in expected - expected[0]:
        assert np.linalg.norm(nodes - point, axis=1).min() < 0.02


def test_nodes_are_a_step_apart() -> None:
    nodes = smoothed_mean_path([CORNER], 0.5, 0.0)
    lengths = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
    # Across the corner it is a little shorter.
    np.testing.assert_allclose(np.delete(lengths, lengths.argmin()), 0.5, atol=0.02)


def test_a_path_leads_so_many_steps_ahead_and_beyond_its_end_as_it_ended() -> None:
    straight = np.linspace([0, 0], [10, 0], 11)
    paths = padded([straight, straight[:6]])
    for look_ahead in (1.5, 3.0):
        led = ahead(paths, 1.0, look_ahead)
        np.testing.assert_allclose(led[0], np.tile([1.0, 0.0], (11, 1)), atol=1e-9)
        np.testing.assert_allclose(led[1, :6], np.tile([1.0, 0.0], (6, 1)), atol=1e-9)
        assert not led[1, 6:].any()


def test_an_end_is_passed_in_the_mean_direction_of_the_last_steps() -> None:
    (normal,) = normals([[CORNER, CORNER @ np.array([[0, 1], [1, 0]])]])
    np.testing.assert_allclose(normal, np.sqrt([0.5, 0.5]), atol=1e-9)
