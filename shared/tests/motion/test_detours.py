"""Ways around an obstacle keep clear of it, and come back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.motion.detours import around
from hmcs.motion.paths import Path

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
def test_spheres_without_a_way_around_are_told(center: list[float], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        around(LINE, center, 0.02, clearance_m=0.01, run_up_m=0.03)
