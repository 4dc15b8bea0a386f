"""Rotations as unit quaternions and as rotation vectors."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hmcs.motion import quaternions

vectors = st.tuples(*[st.floats(-3, 3, allow_subnormal=False)] * 3).map(np.array)


@given(vectors, vectors)
def test_product_and_vectors_are_those_of_scipy(first: np.ndarray, second: np.ndarray) -> None:
    found = quaternions.product(quaternions.from_vector(first), quaternions.from_vector(second))
    expected = (Rotation.from_rotvec(first) * Rotation.from_rotvec(second)).as_quat()
    assert min(np.abs(found - expected).max(), np.abs(found + expected).max()) < 1e-12


@given(vectors, vectors)
def test_turning_by_what_lies_between_leads_from_one_to_the_other(
    first: np.ndarray, second: np.ndarray
) -> None:
    start, end = quaternions.from_vector(first), quaternions.from_vector(second)
    way = quaternions.between(start, end)
    assert np.linalg.norm(way) <= np.pi + 1e-12
    reached = quaternions.turned(start, way / 2, 2.0)
    assert abs(abs(reached @ end) - 1) < 1e-12


def test_between_keeps_its_digits_at_tiny_angles() -> None:
    start = quaternions.from_vector(np.array([0.3, -0.2, 0.9]))
    for size in (1e-15, 1e-9, 1e-5):
        way = np.array([size, -2 * size, size])
        found = quaternions.between(start, quaternions.turned(start, way, 1.0))
        assert np.abs(found - way).max() < 1e-15


@given(vectors)
def test_a_matrix_gives_back_its_quaternion(vector: np.ndarray) -> None:
    found = quaternions.from_matrix(Rotation.from_rotvec(vector).as_matrix())
    expected = Rotation.from_rotvec(vector).as_quat(canonical=False)
    assert found[3] >= 0.0
    assert min(np.abs(found - expected).max(), np.abs(found + expected).max()) < 1e-9
