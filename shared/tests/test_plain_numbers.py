"""Numbers are what anybody reads as such, and not what Python alone does."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.plain_numbers import number_in, separator_in


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_number_that_python_writes_is_read_as_it_was(number: float) -> None:
    assert number_in(repr(number)) == number


@pytest.mark.parametrize(
    ("text", "number"),
    [("1", 1.0), (" +1.5e-3\t", 0.0015), (".5", 0.5), ("5.", 5.0), ("-0", -0.0), ("1E3", 1e3)],
)
def test_what_people_write_is_read(text: str, number: float) -> None:
    assert number_in(text) == number


@pytest.mark.parametrize(
    "text",
    [
        *("", " ", "1_0", "0.5_2", "1 000", "1,5", "0x1F", "1e", "e5", ".", "+", "--1", "1e1_0"),
        *(
            "１２",
            "٣",
            "½",
            "1\u00a0",
            "\u20091",
            "1\n",
            "1\0",
            "(1)",
            "True",
            "1j",
            "$1",
            "9" * 99,
        ),
    ],
)
def test_what_is_no_number_is_reported(text: str) -> None:
    with pytest.raises(ValueError, match="expected a number"):
        number_in(text)


@pytest.mark.parametrize("text", ["nan", "NaN", "-inf", "Infinity", "+INFINITY", "1e999", "-1e400"])
def test_what_is_not_finite_is_reported(text: str) -> None:
    with pytest.raises(ValueError, match="expected a finite number"):
        number_in(text)


def test_separators_are_named() -> None:
    assert [separator_in(text) for text in ("a,b", "a;b", "a\tb", "a|b")] == [
        None,
        "semicolons",
        "tabs",
        "bars",
    ]
