"""Paths against circles and lines."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.motion.paths import Path, mean_path, resample


def circle(turn: float = 2 * np.pi, radius: float = 0.5, count: int = 2001) -> np.ndarray:
    angle = np.linspace(0, turn, count)
    return radius * np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)


def test_arc_length_of_a_circle_is_its_circumference() -> None:
    assert Path(circle()).length_m == pytest.approx(np.pi, rel=1e-5)


@given(st.floats(0, 1))
def test_points_and_tangents_lie_on_the_circle(share: float) -> None:
    path = Path(circle())
    angle = share * 2 * np.pi
    np.testing.assert_allclose(
        path.at(share * path.length_m), (0.5 * np.cos(angle), 0.5 * np.sin(angle), 0), atol=1e-5
    )
    tangent = (-np.sin(angle), np.cos(angle), 0)
    np.testing.assert_allclose(path.tangent(share * path.length_m), tangent, atol=2e-3)
    s = min(max(share, 0.05), 0.95) * path.length_m
    smooth = path.tangent(s, reach_m=0.05)
    angle = s / 0.5
    np.testing.assert_allclose(smooth, (-np.sin(angle), np.cos(angle), 0), atol=1e-4)


@given(st.floats(-0.5, 1.5), st.floats(0.01, 0.4))
def test_projection_finds_the_foot_on_a_line(along: float, beside: float) -> None:
    path = Path(np.array([[0, 0, 0], [0.3, 0, 0], [1.0, 0, 0]]))
    assert path.project((along, beside, beside)) == pytest.approx(np.clip(along, 0, 1), abs=1e-12)


@given(st.integers(0, 10_000))
def test_projection_is_at_least_as_close_as_any_sampled_point(seed: int) -> None:
    rng = np.random.default_rng(seed)
    path, point = Path(rng.normal(size=(12, 3))), rng.normal(size=3)
    sampled = path.at(np.linspace(0, path.length_m, 3000))
    best = np.linalg.norm(sampled - point, axis=1).min()
    assert np.linalg.norm(path.at(path.project(point)) - point) <= best + 1e-12


@given(st.integers(0, 10_000), st.floats(0, 1), st.floats(0.01, 0.5))
def test_a_windowed_projection_is_the_best_within_its_window(
    seed: int, share: float, window_m: float
) -> None:
    rng = np.random.default_rng(seed)
    path, point = Path(rng.normal(size=(12, 3))), rng.normal(size=3)
    near = share * path.length_m
    s = path.project(point, near, window_m)
    assert abs(s - near) <= window_m + 1e-12
    lower, upper = max(0, near - window_m), min(path.length_m, near + window_m)
    sampled = path.at(np.linspace(lower, upper, 1000))
    best = np.linalg.norm(sampled - point, axis=1).min()
    assert np.linalg.norm(path.at(s) - point) <= best + 1e-12


def test_a_path_that_crosses_itself_is_followed_through_its_crossing() -> None:
    t = np.linspace(0, 2 * np.pi, 400)
    eight = Path(np.stack([np.sin(2 * t), np.sin(t), 0 * t], axis=1) * 0.1)
    progress, worst = 0.0, 0.0
    for s in np.linspace(0, eight.length_m, 500):
        progress = eight.project(eight.at(s), near=progress, window_m=0.03)
        worst = max(worst, abs(progress - s))
    assert worst < 1e-6
    # Without the window the crossing is taken for its other passage.
    assert eight.project((0, 0, 0), near=eight.length_m) > 0.9 * eight.length_m


def test_resampled_points_are_evenly_spaced_and_keep_the_ends() -> None:
    rng = np.random.default_rng(1)
    line = np.sort(rng.uniform(0, 1, 50))[:, None] * np.array([1.0, 2.0, 2.0])
    sampled = resample(line, 11)
    np.testing.assert_allclose(
        np.diff(np.linalg.norm(sampled - sampled[0], axis=1), 2), 0, atol=1e-9
    )
    np.testing.assert_allclose(sampled[[0, -1]], line[[0, -1]])


def test_resting_samples_do_not_change_a_path() -> None:
    points = np.repeat(circle(np.pi, count=50), 3, axis=0)
    path = Path(points)
    assert path.length_m == pytest.approx(Path(circle(np.pi, count=50)).length_m)
    for s in (0.0, 0.3, path.length_m):
        assert np.linalg.norm(path.tangent(s)) == pytest.approx(1)


def test_mean_of_parallel_lines_and_how_far_they_lie_beside_it() -> None:
    lines = [
        np.array([[0, 0, 0], [1, slope, 0]]) + np.array([5.0, offset, 1.0])
        for slope, offset in ((0.1, 3), (-0.1, -2))
    ]
    points, spread = mean_path(lines, 11)
    np.testing.assert_allclose(points[:, 0], np.linspace(0, 1, 11), atol=1e-12)
    np.testing.assert_allclose(points[:, 1:], 0, atol=1e-12)
    np.testing.assert_allclose(spread, np.linspace(0, 0.1, 11), atol=1e-12)


def test_spread_does_not_count_what_lies_along_the_path() -> None:
    _, spread = mean_path([np.array([[0, 0, 0], [x, 0, 0]]) for x in (1.0, 2.0)], 5)
    np.testing.assert_allclose(spread, 0, atol=1e-12)


def test_one_demonstration_is_its_own_mean() -> None:
    points, spread = mean_path([circle()], 50)
    np.testing.assert_allclose(points, resample(circle(), 50) - circle()[0], atol=1e-12)
    np.testing.assert_allclose(spread, 0, atol=1e-12)


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 3)),
        np.zeros((1, 3)),
        np.zeros((5, 3)),
        np.zeros((5, 2)),
        np.array([[0, 0, 0], [np.nan, 0, 0]]),
    ],
)
def test_what_is_no_path_is_refused(points: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"path needs two|expected"):
        Path(points)


def test_a_mean_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="no path"):
        mean_path([])
