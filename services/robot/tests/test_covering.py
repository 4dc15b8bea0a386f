"""Boxes about a surface: all triangles are in them, they are few, and they lie close to it."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from hmcs_robot.covering import LEAST_HALF_M, CoveringBox, covering

ROUNDING_M = 1e-9


def outside_m(box: CoveringBox, points: np.ndarray) -> np.ndarray:
    """How far points stick out of a box."""
    return np.asarray((np.abs((points - box.center) @ box.axes) - box.halves).max(axis=-1))


@settings(max_examples=50)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 60),
    most=st.integers(1, 40),
    flat=st.booleans(),
)
def test_every_triangle_is_in_a_box(seed: int, count: int, most: int, flat: bool) -> None:
    corners = np.random.default_rng(seed).normal(size=(count, 3, 3))
    if flat:
        corners[..., 2] = 0.5
    boxes = covering(corners, most)
    assert 1 <= len(boxes) <= most
    for box in boxes:
        assert np.linalg.det(box.axes) == pytest.approx(1.0)
        assert (box.halves >= LEAST_HALF_M).all()
    out = np.array([outside_m(box, corners).max(axis=1) for box in boxes])
    assert (out.min(axis=0) <= ROUNDING_M).all()


def test_boxes_about_a_ball_lie_close_to_it_and_leave_its_middle_free() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    boxes = covering(np.asarray(ball.triangles), 128)
    assert len(boxes) == 128
    assert max(2.0 * float(box.halves.min()) for box in boxes) < 0.003
    assert min(float(outside_m(box, np.zeros(3))) for box in boxes) > 0.04


def test_boxes_about_a_flat_frame_leave_its_opening_free() -> None:
    frame = trimesh.creation.annulus(r_min=0.1, r_max=0.12, height=0.004)
    boxes = covering(np.asarray(frame.triangles), 64)
    assert min(float(outside_m(box, np.zeros(3))) for box in boxes) > 0.06
