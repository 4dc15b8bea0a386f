"""What both sides of a takeover hold to, whoever asks."""

from __future__ import annotations

import pytest

from hmcs.bus.keys import Member
from hmcs.bus.messages import ActivateRecognizer, LoadModel
from hmcs.recognizer_takeover import (
    NOTHING_COMPARED,
    Agreement,
    SameNameError,
    Shadows,
    activate,
    check_names_differ,
    load_into_fixture,
    load_into_recognizer,
    publishes_beliefs,
)


def test_a_shadow_agrees_in_the_steps_both_saw() -> None:
    shadows = Shadows()
    for step, state in enumerate(("x", "x", "y", "y")):
        shadows.heard("active", "clock", step, state)
    for step, state in ((1, "x"), (2, "x"), (3, "y"), (9, "y")):
        shadows.heard("shadow", "clock", step, state)
    shadows.heard("shadow", "another clock", 0, "z")
    assert shadows.agreement("active") == {"shadow": Agreement(same=2, compared=3)}
    assert shadows.recognizers == ("active", "shadow")


def test_nobody_agrees_with_a_recognizer_that_said_nothing() -> None:
    shadows = Shadows()
    shadows.heard("shadow", "clock", 0, "x")
    assert shadows.agreement("") == {}


def test_only_the_newest_steps_are_compared() -> None:
    shadows = Shadows(steps=2)
    for step in range(5):
        shadows.heard("active", "c", step, "x")
        shadows.heard("shadow", "c", step, "x" if step > 2 else "y")
    assert shadows.agreement("active")["shadow"] == Agreement(2, 2)


def test_all_steps_are_compared_where_none_are_to_be_left_out() -> None:
    shadows = Shadows(steps=None)
    for step in range(1000):
        shadows.heard("active", "c", step, "x")
        shadows.heard("shadow", "c", step, "x")
    assert shadows.agreement("active")["shadow"] == Agreement(1000, 1000)


def test_step_of_which_two_processes_of_a_recognizer_speak_is_one_step() -> None:
    shadows = Shadows()
    shadows.heard("active", "c", 0, "x")
    for state in ("y", "x"):
        shadows.heard("shadow", "c", 0, state)
    assert shadows.agreement("active")["shadow"] == Agreement(same=1, compared=1)


def test_what_was_forgotten_is_not_compared() -> None:
    shadows = Shadows()
    for name in ("active", "shadow"):
        shadows.heard(name, "c", 0, "x")
    shadows.forget("shadow")
    assert shadows.agreement("active") == {}


def test_agreement_is_reported_as_a_share_of_the_steps_that_were_compared() -> None:
    assert str(Agreement(same=3, compared=4)) == "the same likely state in 75% of 4 steps"
    assert str(NOTHING_COMPARED) == "nothing was compared"


def test_recognizers_of_one_name_do_not_take_over_from_each_other() -> None:
    check_names_differ("mine", "yours")
    with pytest.raises(SameNameError, match=r"'mine'.*another name"):
        check_names_differ("mine", "mine")


def test_requests_go_to_those_who_carry_them_out() -> None:
    path = "/models/mine.hmcs"
    asked = (load_into_fixture(path), load_into_recognizer(path), activate("mine"))
    assert [(each.service, each.verb.name, each.body) for each in asked] == [
        ("fixture_controller", "load_model", LoadModel(path=path)),
        ("recognizer", "load_model", LoadModel(path=path)),
        ("fixture_controller", "activate", ActivateRecognizer(model="mine")),
    ]
    assert all(each.service in each.verb.services for each in asked)


def test_classifiers_speak_for_no_model_and_everybody_else_does() -> None:
    assert not publishes_beliefs(Member("gesteme_classifier", "a"))
    for service in ("task_hmm", "recognizer", "my_recognizer"):
        assert publishes_beliefs(Member(service, "a"))
