"""Key expressions: who sees whom, and which names are none."""

from __future__ import annotations

import pytest
import zenoh
from hypothesis import assume, given
from hypothesis import strategies as st

from hmcs.bus.keys import PREFIX, KeyNameError, Keys, Member, Recognizer, check_name, recognizer_in

names = st.from_regex(r"[A-Za-z0-9][A-Za-z0-9._-]{0,12}", fullmatch=True)
FORBIDDEN = "*$/?#@ \n\0"


def all_keys(keys: Keys, model: str, service: str, instance: str) -> list[str]:
    return [
        keys.motion,
        keys.step,
        keys.command,
        keys.fixture_state,
        keys.robot_state,
        keys.evidence(model, instance),
        keys.belief(model, instance),
        keys.member(model, service, instance),
        keys.presence(service, instance),
        keys.rpc(service, instance, "health"),
    ]


@given(names, names, names, names)
def test_every_key_is_a_canonical_key_expression_without_wildcards(
    cell, model, service, instance
) -> None:
    for key in all_keys(Keys(cell), model, service, instance):
        assert str(zenoh.KeyExpr.autocanonize(key)) == key
        assert "*" not in key
        assert key.startswith(f"{PREFIX}/{cell}/")


@given(names, names, names, names)
def test_no_two_subjects_of_a_cell_meet(cell, model, service, instance) -> None:
    keys = all_keys(Keys(cell), model, service, instance)
    assert len(set(keys)) == len(keys)


@given(names, names, names)
def test_cells_do_not_see_each_other_even_with_wildcards(one, other, service) -> None:
    assume(one != other)
    mine, theirs = Keys(one), Keys(other)
    assert not zenoh.KeyExpr(mine.presence()).intersects(theirs.presence(service, "a"))
    assert not zenoh.KeyExpr(mine.evidence("m")).intersects(theirs.evidence("m", "a"))


@given(names, names, names)
def test_a_wildcard_sees_every_instance_and_nothing_else(cell, service, instance) -> None:
    keys = Keys(cell)
    assert zenoh.KeyExpr(keys.presence(service)).includes(keys.presence(service, instance))
    assert zenoh.KeyExpr(keys.belief()).includes(keys.belief(service, instance))
    assert not zenoh.KeyExpr(keys.presence()).intersects(keys.member("m", service, instance))
    assert not zenoh.KeyExpr(keys.belief()).intersects(keys.evidence(service, instance))


@given(names)
def test_another_version_never_matches(cell) -> None:
    key = zenoh.KeyExpr(Keys(cell).motion)
    assert not zenoh.KeyExpr("hmcs/**").intersects(key)
    assert not zenoh.KeyExpr(f"hmcs/@v2/{cell}/**").intersects(key)
    assert zenoh.KeyExpr(f"hmcs/@v1/{cell}/**").includes(key)


@given(names, names, names, names)
def test_presence_and_member_keys_name_their_process(cell, model, service, instance) -> None:
    keys = Keys(cell)
    assert keys.member_of(keys.presence(service, instance)) == Member(service, instance)
    assert keys.member_of(keys.member(model, service, instance)) == Member(service, instance)


@given(names, names, names)
def test_keys_of_evidence_and_belief_name_model_and_instance(cell, model, instance) -> None:
    keys = Keys(cell)
    for key in (keys.evidence(model, instance), keys.belief(model, instance)):
        assert recognizer_in(key) == Recognizer(model, instance)
    without_instance = keys.belief(model, instance).removesuffix(f"/{instance}")
    assert recognizer_in(without_instance) == Recognizer(model, "")
    for key in (keys.motion, keys.member(model, "s", instance), "model/m/belief/i"):
        with pytest.raises(KeyNameError, match="no belief or evidence key"):
            recognizer_in(key)
    assert keys.model_of(keys.member(model, "s", instance)) == model
    with pytest.raises(KeyNameError, match="no member key"):
        keys.model_of(keys.presence("s", instance))


@given(names, names)
def test_other_keys_name_no_process(cell, other) -> None:
    assume(cell != other)
    keys = Keys(cell)
    for key in (keys.motion, keys.evidence("m", "a"), Keys(other).presence("s", "a"), "x/y/z"):
        with pytest.raises(KeyNameError, match="no presence or member key"):
            keys.member_of(key)


@given(st.text(max_size=4), st.sampled_from(FORBIDDEN), st.text(max_size=4))
def test_a_name_with_a_meaning_in_keys_is_refused(before, bad, after) -> None:
    with pytest.raises(KeyNameError, match="letters, digits"):
        check_name("cell", before + bad + after)


@pytest.mark.parametrize("bad", ["", "*", "**", "$*", "a/b", "a$*", "@v1", "é", "-a", "a" * 65])
def test_names_that_are_none_are_refused_everywhere(bad) -> None:
    keys = Keys("demo")
    with pytest.raises(KeyNameError, match="cell"):
        Keys(bad)
    if bad == "*":
        return
    for make in (
        lambda: keys.evidence(bad),
        lambda: keys.evidence("m", bad),
        lambda: keys.belief(bad),
        lambda: keys.belief("m", bad),
        lambda: keys.member("m", "s", bad),
        lambda: keys.presence(bad),
        lambda: keys.rpc("s", bad, "health"),
        lambda: keys.rpc("s", "i", bad),
    ):
        with pytest.raises(KeyNameError, match="letters, digits"):
            make()


@given(names)
def test_a_valid_name_is_returned_as_it_is(name) -> None:
    assert check_name("cell", name) == name
