"""Arrays as fields of messages."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from pydantic import ValidationError

from hmcs.bus.arrays import LARGEST, ArraySpec, to_wire
from hmcs.bus.messages import Command, Evidence

VECTOR = ArraySpec((3,))
finite = st.floats(-LARGEST, LARGEST)


@given(npst.arrays(np.float64, npst.array_shapes(max_dims=3, min_side=0), elements=finite))
def test_an_array_comes_back_from_the_wire_bit_equal(array) -> None:
    spec = ArraySpec((None,) * array.ndim)
    back = spec.read(to_wire(array))
    assert back.tobytes() == array.tobytes()
    assert back.shape == array.shape


@given(st.lists(finite, max_size=6))
def test_only_the_shape_of_the_field_is_admitted(numbers) -> None:
    if len(numbers) == 3:
        assert VECTOR.read(numbers).tolist() == numbers
    else:
        with pytest.raises(ValueError, match=r"expected \(3\)"):
            VECTOR.read(numbers)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_refused_where_it_is_made(bad) -> None:
    with pytest.raises(ValueError, match="not finite"):
        VECTOR.read([0.0, bad, 0.0])


@pytest.mark.parametrize("turn", [[0, 0, 0, 1.01], [0, 0, 0, 0], [1, 1, 0, 0]])
def test_what_is_no_rotation_is_refused_as_a_quaternion(turn) -> None:
    spec = ArraySpec((4,), unit=True)
    with pytest.raises(ValueError, match="expected a length of 1"):
        spec.read(to_wire(np.array(turn, dtype=float)), from_wire=True)
    assert spec.read([0.0, 0.6, 0.0, -0.8]).tolist() == [0.0, 0.6, 0.0, -0.8]


def test_a_field_is_a_copy_nobody_can_change() -> None:
    mine = np.zeros(3)
    read = VECTOR.read(mine)
    mine[0] = 1.0
    assert read[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        read[0] = 2.0


def test_on_the_wire_numbers_are_little_endian_in_c_order() -> None:
    array = np.arange(6, dtype=">f8").reshape(2, 3).T
    back = ArraySpec((3, 2)).read(array)
    assert to_wire(back)["dtype"] == "<f8"
    assert ArraySpec((3, 2)).read(to_wire(back)).tolist() == array.tolist()


def test_integers_are_admitted_as_floats_but_floats_not_as_integers() -> None:
    assert VECTOR.read([1, 2, 3]).dtype == np.dtype("<f8")
    with pytest.raises((TypeError, ValueError)):
        ArraySpec((None,), ("<i4",)).read([1.5])


def test_evidence_travels_as_float32_and_as_float64() -> None:
    for dtype in ("<f4", "<f8"):
        evidence = Evidence(
            model_hash="h",
            clock="c",
            step=0,
            gestemes=(),
            pair_gesteme=np.array([0], dtype="<i4"),
            pair_start=np.array([0], dtype="<i4"),
            exit=np.array([0.1], dtype=dtype),
            log_ratio=np.array([0.2], dtype=dtype),
        )
        assert evidence.exit.dtype == np.dtype(dtype)


def test_a_message_with_a_wrong_array_cannot_be_made() -> None:
    with pytest.raises(ValidationError, match="twist"):
        Command(twist=np.zeros(3), valid_for_ns=1, engaged=True)
