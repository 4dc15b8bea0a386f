"""Tokens of any name: which process they stand for, if any."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.keys import Keys, Member
from hmcs.bus.presence import is_token, present

KEYS = Keys("demo")
IMPOSSIBLE = ["evil name", "\x1b[2Jx", "n" * 300, "", "*", "$x", "-x", "\u202ex", "a?b"]


def test_a_token_stands_for_its_process() -> None:
    token = KEYS.member("mine", "recognizer", "r-1")
    found = present(KEYS, [token, KEYS.presence("robot", "r")])
    assert found.members == (Member("recognizer", "r-1"), Member("robot", "r"))
    assert (KEYS.model_of(token), found.strangers) == ("mine", ())


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_a_name_that_is_impossible_stands_for_nobody(name) -> None:
    for token in (
        f"hmcs/@v1/demo/presence/robot/{name}",
        f"hmcs/@v1/demo/presence/{name}/r",
        f"hmcs/@v1/demo/model/m/member/recognizer/{name}",
        f"hmcs/@v1/demo/model/m/member/{name}/r",
        f"hmcs/@v1/demo/model/{name}/member/recognizer/r",
    ):
        assert not is_token(KEYS, token)


@given(st.text())
def test_whatever_the_token_it_is_judged(text) -> None:
    for token in (text, f"hmcs/@v1/demo/{text}", KEYS.presence("robot", "r") + text):
        found = present(KEYS, [token])
        assert found.strangers == (token,) or found.tokens == (token,)


def test_members_come_sorted_and_once_strangers_beside_them() -> None:
    one, other = KEYS.presence("robot", "b"), KEYS.presence("robot", "a")
    strange = "hmcs/@v1/demo/presence/robot/evil name"
    found = present(KEYS, [one, strange, other, one])
    assert found.members == (Member("robot", "a"), Member("robot", "b"))
    assert found.strangers == (strange,)
