"""A newcomer takes over: the time is passed in, the answers are the test's."""

from __future__ import annotations

import pytest

from hmcs.bus.messages import ActivateRecognizer, LoadModel, TrainingProgress
from hmcs.recognizer_takeover import Agreement
from hmcs_console.teaching import takeover
from hmcs_console.teaching.takeover import Advance, Followed, Takeover

COMPARE_S = 5.0
NOTHING = Agreement(0, 0)


def trained(name: str = "mine", stage: str = "done") -> TrainingProgress:
    return TrainingProgress.model_validate(
        {
            "model": name,
            "stage": stage,
            "detail": "learned",
            "share": 1.0,
            "path": f"/m/{name}.hmcs",
        }
    )


def loaded(active: str = "old", compare_s: float = COMPARE_S) -> Advance:
    """Both loaded at 10 s."""
    advance = takeover.begun(trained(), active)
    for _ in range(2):
        advance = takeover.answered(advance.takeover, "loaded", 10.0, compare_s)
    return advance


def asked(advance: Advance) -> tuple[str, str] | None:
    return None if advance.ask is None else (advance.ask.service, advance.ask.verb.name)


def test_a_newcomer_is_lent_to_the_fixture_then_loaded_then_compared_then_activated() -> None:
    advance = takeover.begun(trained(), "old")
    assert asked(advance) == ("fixture_controller", "load_model")
    advance = takeover.answered(advance.takeover, "loaded", 9.0, COMPARE_S)
    assert asked(advance) == ("recognizer", "load_model")
    assert advance.ask is not None
    assert advance.ask.body == LoadModel(path="/m/mine.hmcs")
    advance = takeover.answered(advance.takeover, "at work", 10.0, COMPARE_S)
    assert (advance.takeover.stage, advance.ask) == ("comparing", None)
    advance = takeover.at(advance.takeover, 14.9, Agreement(97, 100), there=True)
    assert (advance.takeover.stage, advance.ask) == ("comparing", None)
    advance = takeover.at(advance.takeover, 15.0, Agreement(98, 101), there=True)
    assert asked(advance) == ("fixture_controller", "activate")
    assert advance.ask is not None
    assert advance.ask.body == ActivateRecognizer(model="mine")
    end = takeover.answered(advance.takeover, "follows mine", 15.1, COMPARE_S)
    assert (end.takeover.stage, end.ask) == ("done", None)
    assert takeover.said(end.takeover, 99.0) == (
        "**mine** took over: follows mine  \nbeside old: the same likely state in 97% of 101 steps"
        "  \nloaded  \nat work"
    )


def test_how_it_does_beside_the_active_one_is_reported_with_what_was_said_on_loading_it() -> None:
    comparing = takeover.at(loaded().takeover, 12.4, Agreement(117, 120), there=True).takeover
    assert takeover.said(comparing, 12.4) == (
        "**mine** runs beside old: the same likely state in 98% of 120 steps, active in 3 s"
        "  \nloaded  \nloaded"
    )


def test_a_hand_that_does_not_move_compares_nothing_which_is_reported() -> None:
    comparing = takeover.at(loaded().takeover, 12.0, NOTHING, there=True)
    assert "the hand does not move: nothing is compared" in takeover.said(comparing.takeover, 12.0)
    end = takeover.at(comparing.takeover, 15.0, NOTHING, there=True)
    done = takeover.answered(end.takeover, "follows mine", 15.0, COMPARE_S)
    assert "nothing was compared" in takeover.said(done.takeover, 15.0)


@pytest.mark.parametrize(("active", "compare_s"), [("", COMPARE_S), ("old", 0.0)])
def test_where_there_is_nothing_to_compare_with_it_is_activated_at_once(
    active: str, compare_s: float
) -> None:
    advance = loaded(active, compare_s)
    assert (advance.takeover.stage, asked(advance)) == (
        "activating",
        ("fixture_controller", "activate"),
    )


def test_who_is_in_a_hurry_goes_on_at_once_while_it_is_compared_or_loaded() -> None:
    assert asked(takeover.hurried(loaded().takeover)) == ("fixture_controller", "activate")
    loading = takeover.hurried(takeover.begun(trained(), "old").takeover)
    assert loading.ask is None
    for _ in range(2):
        loading = takeover.answered(loading.takeover, "loaded", 10.0, COMPARE_S)
    assert asked(loading) == ("fixture_controller", "activate")


def test_a_refusal_at_any_stage_ends_it_with_what_was_active_still_active() -> None:
    first = takeover.begun(trained(), "old").takeover
    second = takeover.answered(first, "loaded", 9.0, COMPARE_S).takeover
    activating = takeover.hurried(loaded().takeover).takeover
    for stage in (first, second, activating):
        end = takeover.refused(stage, "robot on fire")
        assert (end.takeover.stage, end.ask) == ("failed", None)
        assert takeover.said(end.takeover, 0.0) == (
            "**mine** did not take over, old is active still: robot on fire"
        )


def test_a_newcomer_whose_process_goes_is_not_activated() -> None:
    end = takeover.at(loaded().takeover, 99.0, NOTHING, there=False)
    assert (end.takeover.stage, end.ask) == ("failed", None)
    assert "gone" in end.takeover.detail


def test_it_can_be_called_off_while_it_is_compared_only() -> None:
    assert takeover.called_off(loaded().takeover).takeover.stage == "failed"
    for takes in (takeover.begun(trained(), "old"), takeover.hurried(loaded().takeover)):
        assert takeover.called_off(takes.takeover) == Advance(takes.takeover)


@pytest.mark.parametrize("progress", [None, trained(stage="failed"), trained(stage="judging")])
def test_what_was_not_trained_to_its_end_does_not_take_over(
    progress: TrainingProgress | None,
) -> None:
    advance = takeover.begun(progress, "old")
    assert (advance.takeover.stage, advance.ask) == ("failed", None)
    assert "train first" in takeover.said(advance.takeover, 0.0)


def test_a_newcomer_of_the_active_ones_name_would_replace_it_uncompared_and_is_refused() -> None:
    advance = takeover.begun(trained("old"), "old")
    assert (advance.takeover.stage, advance.ask) == ("failed", None)
    assert "another" in advance.takeover.detail


def test_what_has_ended_stays_as_it_is() -> None:
    for stage in ("done", "failed"):
        ended = Takeover("mine", "old", stage, detail="so it was")
        for advance in (
            takeover.at(ended, 99.0, Agreement(1, 2), there=False),
            takeover.hurried(ended),
            takeover.called_off(ended),
        ):
            assert advance == Advance(ended)


def test_who_was_active_before_is_known_whoever_changed_it() -> None:
    known = Followed()
    for active in ("", "one", "one", "", "two"):
        known = takeover.followed(known, active)
    assert known == Followed("two", "one")
    assert takeover.followed(known, "one") == Followed("one", "two")


def test_nothing_is_said_of_no_newcomer() -> None:
    assert takeover.said(None, 0.0) == ""
