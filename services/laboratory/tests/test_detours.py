"""Ways around an obstacle keep clear of it, and come back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs.motion.paths import Path
from hmcs_laboratory.assistance.detours import around

LINE = Path(np.array([[0.0, 0, 0], [0.4, 0, 0]]))


@given(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02), st.floats(0.14, 0.26))
def test_the_way_around_keeps_its_clearance_and_rejoins_the_path(
    y: float, z: float, x: float
) -> None:
    center = np.array([x, y, z])
    detour = around(LINE, center, 0.02, clearance_m=0.015, run_up_m=0.03)
    gaps = np.linalg.norm(detour.path.points - center, axis=1)
    assert gaps.min() == pytest.approx(0.035, abs=5e-4)
    np.testing.assert_allclose(detour.path.points[[0, -1]], LINE.points[[0, -1]], atol=1e-12)
    before = detour.path.points[detour.path.arc_length < detour.leaves_at_m]
    np.testing.assert_allclose(before[:, 1:], 0.0, atol=1e-12)


def test_a_path_through_the_middle_has_a_way_around_too() -> None:
    detour = around(LINE, [0.2, 0, 0], 0.02, clearance_m=0.01, run_up_m=0.03)
    assert np.linalg.norm(detour.path.points - [0.2, 0, 0], axis=1).min() >= 0.0299


@pytest.mark.parametrize(
    ("center", "says"), [([0.2, 0.1, 0.0], "nothing to avoid"), ([0.01, 0, 0], "end of the path")]
)
def test_spheres_without_a_way_around_are_reported(center: list[float], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        around(LINE, center, 0.02, clearance_m=0.01, run_up_m=0.03)


def nearest_m(path: Path, center: np.ndarray) -> float:
    """By itself, not as the code measures it: many points along the way."""
    along = path.at(np.linspace(0.0, path.length_m, 20_000))
    return float(np.linalg.norm(along - center, axis=1).min())


def hairpin() -> Path:
    angle = np.linspace(0, np.pi, 40)
    x = np.linspace(0, 0.3, 60)
    there = np.stack([x, np.full(60, 0.03), 0 * x], axis=1)
    turn = np.stack([0.3 + 0.03 * np.sin(angle), 0.03 * np.cos(angle), 0 * angle], axis=1)
    return Path(np.vstack([there, turn, (there * [1, -1, 1])[::-1]]))


ZIGZAG = Path(np.array([[0, 0, 0], [0.15, 0, 0], [0.02, 0.03, 0.0], [0.3, 0.06, 0]]))


@pytest.mark.parametrize(
    ("path", "center"),
    [
        (hairpin(), (0.15, 0.012, 0)),
        (hairpin(), (0.15, 0.0, 0)),  # both legs come too near
        (hairpin(), (0.30, 0.0, 0)),  # within the turn
        (ZIGZAG, (0.12, 0.004, 0)),
        (ZIGZAG, (0.08, 0.015, 0)),
        (LINE, (0.045, 0.0, 0)),  # no room for the whole run-up
    ],
)
def test_a_path_that_comes_by_twice_or_turns_sharply_is_clear_along_its_whole_way(
    path: Path, center: tuple[float, ...]
) -> None:
    middle = np.array(center, dtype=float)
    detour = around(path, middle, 0.025, clearance_m=0.01, run_up_m=0.03)
    assert nearest_m(detour.path, middle) >= 0.035 - 2.5e-4
    np.testing.assert_allclose(detour.path.points[[0, -1]], path.points[[0, -1]], atol=1e-12)


def test_a_path_that_winds_about_the_sphere_has_no_way_around_and_says_so() -> None:
    angle = np.linspace(0, 40 * np.pi, 4_000)
    height = np.linspace(-0.05, 0.05, len(angle))
    circles = 0.025 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    coil = circles + height[:, None] * [0, 0, 1]
    with pytest.raises(ValueError, match=r"no way around .* winds about it"):
        around(Path(coil), [0, 0, 0], 0.02, clearance_m=0.01, run_up_m=0.01)


coordinates = st.floats(-0.2, 0.2)
points = st.tuples(coordinates, coordinates, coordinates)


@settings(max_examples=100, deadline=None)
@given(st.lists(points, min_size=2, max_size=6, unique=True), points, st.floats(0.005, 0.05))
def test_every_way_around_is_clear_or_it_is_reported_that_there_is_none(
    corners: list[tuple[float, ...]], center: tuple[float, ...], radius_m: float
) -> None:
    path, middle = Path(np.array(corners)), np.array(center)
    try:
        detour = around(path, middle, radius_m, clearance_m=0.01, run_up_m=0.02)
    except ValueError:
        return
    assert nearest_m(detour.path, middle) >= radius_m + 0.01 - 2.5e-4
    np.testing.assert_allclose(detour.path.points[[0, -1]], path.points[[0, -1]], atol=1e-12)
    assert 0 <= detour.leaves_at_m <= detour.returns_at_m <= path.length_m
    leaves = detour.path.at(detour.leaves_at_m)
    assert np.linalg.norm(path.at(path.project(leaves)) - leaves) < 2e-3


@pytest.mark.parametrize(
    ("center", "radius_m", "run_up_m"),
    [
        ([0.2, np.nan, 0], 0.02, 0.03),
        ([0.2, 0], 0.02, 0.03),
        ([0.2, 0, 0], -1.0, 0.03),
        ([0.2, 0, 0], 0.02, -0.01),
        ([0.2, 0, 0], np.inf, 0.01),
    ],
)
def test_numbers_that_cannot_be_are_reported(
    center: list[float], radius_m: float, run_up_m: float
) -> None:
    with pytest.raises(ValueError, match="expected"):
        around(LINE, center, radius_m, clearance_m=0.01, run_up_m=run_up_m)
