"""Tokens of any name: which process they stand for, if any."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.keys import Keys, Member
from hmcs.bus.presence import member_named, model_named, present

KEYS = Keys("demo")
IMPOSSIBLE = ["evil name", "\x1b[2Jx", "n" * 300, "", "*", "$x", "-x", "\u202ex", "a?b"]


def test_a_token_stands_for_its_process() -> None:
    assert member_named(KEYS, KEYS.presence("robot", "r")) == Member("robot", "r")
    token = KEYS.member("mine", "recognizer", "r-1")
    assert member_named(KEYS, token) == Member("recognizer", "r-1")
    assert model_named(KEYS, token) == "mine"
    assert model_named(KEYS, KEYS.presence("model", "x")) == ""


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_a_name_that_is_impossible_stands_for_nobody(name) -> None:
    for token in (
        f"hmcs/@v1/demo/presence/robot/{name}",
        f"hmcs/@v1/demo/presence/{name}/r",
        f"hmcs/@v1/demo/model/m/member/recognizer/{name}",
        f"hmcs/@v1/demo/model/m/member/{name}/r",
        f"hmcs/@v1/demo/model/{name}/member/recognizer/r",
    ):
        assert member_named(KEYS, token) is None


@given(st.text())
def test_whatever_the_token_somebody_or_nobody_is_returned(text) -> None:
    for token in (text, f"hmcs/@v1/demo/{text}", KEYS.presence("robot", "r") + text):
        member_named(KEYS, token)


def test_members_come_sorted_and_once_strangers_beside_them() -> None:
    one, other = KEYS.presence("robot", "b"), KEYS.presence("robot", "a")
    strange = "hmcs/@v1/demo/presence/robot/evil name"
    found = present(KEYS, [one, strange, other, one])
    assert found.members == (Member("robot", "a"), Member("robot", "b"))
    assert found.strangers == (strange,)
