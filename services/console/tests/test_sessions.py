from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from hmcs_console.serving.sessions import (
    FREE_TRIES,
    LONGEST_WAIT_S,
    MOST_SOURCES,
    Tries,
    same,
    source_of,
)


def test_the_first_wrong_tokens_cost_nothing_and_each_later_one_twice_as_much() -> None:
    tries, waits = Tries(), []
    for _ in range(FREE_TRIES + 3):
        tries.failed("192.0.2.1", 0.0)
        waits.append(tries.wait_s("192.0.2.1", 0.0))
    assert waits == [0.0] * (FREE_TRIES - 1) + [1.0, 2.0, 4.0, 8.0]


def test_nobody_waits_for_ever() -> None:
    tries = Tries()
    for _ in range(2000):
        tries.failed("192.0.2.1", 0.0)
    assert tries.wait_s("192.0.2.1", 0.0) == LONGEST_WAIT_S


def test_what_is_remembered_of_tries_is_bounded() -> None:
    tries = Tries()
    for number in range(3 * MOST_SOURCES):
        tries.failed(f"2001:db8:{number:x}::1", 0.0)
        tries.failed("192.0.2.1", 0.0)
    assert len(tries._of) == MOST_SOURCES
    assert tries.wait_s("192.0.2.1", 0.0) == LONGEST_WAIT_S


def test_who_has_a_network_is_one_source() -> None:
    assert source_of("2001:db8:1:2::1") == source_of("2001:db8:1:2:3:4:5:6")
    assert source_of("2001:db8:1:2::1") != source_of("2001:db8:1:3::1")
    assert source_of("::ffff:192.0.2.1") == source_of("192.0.2.1")
    assert source_of("fe80::1%eth0") == source_of("fe80::2")
    assert source_of("192.0.2.1") != source_of("192.0.2.2")


@given(st.text(max_size=8), st.text(max_size=8))
def test_two_texts_are_the_same_or_not(one: str, other: str) -> None:
    assert same(one, one)
    assert same(one, other) == (one == other)
