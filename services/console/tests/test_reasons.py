"""Why a state is likely and what would change that, against odds and angles worked out by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hmcs.bus.messages import Belief, Evidence, FixtureState
from hmcs.motion.paths import Path
from hmcs.task import Task
from hmcs_console.seeing.step_evidence import (
    STEPS,
    StepEvidence,
    evidence_of,
    usable,
    with_evidence,
)
from hmcs_console.telling import spoken_reasons
from hmcs_console.telling.reasons import MOST_RIVALS, Reasons, log_ratio, reasons_of, turn
from support.lessons import lesson_task

X, Y, Z = np.eye(3)
NAMES = ("reach", "turn", "lift", "turn-back")
PATHS = {
    "reach": Path(np.array([[0.0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0]])),
    "turn": Path(np.array([[0.0, 0, 0], [0, 0, -0.1], [0, 0.1, -0.1]])),
    "lift": Path(np.array([[0.0, 0, 0], [0, 0, 0.1], [-0.1, 0, 0.1]])),
}
"""Of `reach`, `turn` (and `turn-back`), and `lift`, which follow one another in a ring."""


def belief(*probabilities: float, **fields: Any) -> Belief:
    said: dict[str, Any] = {
        "model_hash": "h",
        "clock": "c",
        "step": 41,
        "states": NAMES,
        "probabilities": np.array(probabilities),
        "likely_gesteme": "reach",
        "segment_start": 12,
    }
    return Belief(**(said | fields))


def evidence(gestemes: dict[str, dict[int, float]], **fields: Any) -> Evidence:
    """Evidence of gestemes, each with its log ratios by start."""
    names = tuple(gestemes)
    pairs = [
        (names.index(name), start, ratio)
        for name, by_start in gestemes.items()
        for start, ratio in by_start.items()
    ]
    said: dict[str, Any] = {
        "model_hash": "h",
        "clock": "c",
        "step": 41,
        "gestemes": names,
        "pair_gesteme": np.array([pair[0] for pair in pairs], dtype=np.int32),
        "pair_start": np.array([pair[1] for pair in pairs], dtype=np.int32),
        "exit": np.zeros(len(pairs), dtype=np.float32),
        "log_ratio": np.array([pair[2] for pair in pairs], dtype=np.float32),
    }
    return Evidence(**(said | fields))


def fixture(progress: float, state: str = "reach", gesteme: str = "reach") -> FixtureState:
    still = np.zeros(6)
    return FixtureState(
        law="general",
        model="m",
        state=state,
        factor=0.5,
        compliance=0.5,
        preferred_direction=np.zeros(3),
        progress=progress,
        gesteme=gesteme,
        operator_twist=still,
        command_twist=still,
        wrench=still,
        engaged=True,
        reason="guiding",
    )


def reported(
    said: Belief,
    *heard: Evidence,
    leads: FixtureState | None = None,
    task: Task | None = None,
) -> Reasons:
    reasons = reasons_of(said, heard, leads, task or lesson_task(), PATHS)
    assert reasons is not None
    return reasons


def test_odds_are_in_nats_and_rivals_come_by_their_probability() -> None:
    rivals = reported(belief(0.64, 0.08, 0.0, 0.16)).rivals
    assert [rival.state for rival in rivals] == ["turn-back", "turn"]
    odds = [rival.odds_nats for rival in rivals]
    assert odds == pytest.approx([1.386294, 2.079442], abs=1e-5)  # ln 4, ln 8
    assert [rival.follows for rival in rivals] == [False, True]


def test_what_may_follow_is_reported_though_nothing_speaks_for_it_yet() -> None:
    (rival,) = reported(belief(1.0, 0.0, 0.005, 0.0)).rivals
    assert (rival.state, rival.probability, rival.odds_nats) == ("turn", 0.0, None)


def test_few_rivals_are_reported_of_many() -> None:
    lesson = lesson_task()
    states = [lesson.states[0].model_copy(update={"name": f"s{number}"}) for number in range(9)]
    many = lesson.model_copy(update={"states": tuple(states)})
    names = tuple(state.name for state in states)
    said = belief(*[0.2, *[0.1] * 8], states=names)
    assert len(reported(said, task=many).rivals) == MOST_RIVALS


def test_progress_is_reported_along_the_guide_that_leads() -> None:
    reasons = reported(belief(0.9, 0.1, 0.0, 0.0), leads=fixture(0.75))
    assert (reasons.likely, reasons.gesteme, reasons.progress) == ("reach", "reach", 0.75)
    assert reasons.left_m == pytest.approx(0.05)


@pytest.mark.parametrize("leads", [None, fixture(0.75, "turn", "turn"), fixture(0.75, "reach", "")])
def test_where_nothing_leads_in_the_likely_state_neither_progress_nor_turns_are_reported(
    leads: FixtureState | None,
) -> None:
    reasons = reported(belief(0.9, 0.1, 0.0, 0.0), leads=leads)
    assert (reasons.progress, reasons.left_m) == (None, None)
    assert {rival.turn_rad for rival in reasons.rivals} == {None}


def test_what_follows_would_turn_the_hand_to_where_its_guide_begins() -> None:
    (rival,) = reported(belief(0.9, 0.1, 0.0, 0.0), leads=fixture(0.25)).rivals
    assert rival.turn_rad == pytest.approx(np.pi / 2)
    assert_allclose(rival.toward, -Z, atol=1e-9)


def test_what_was_before_would_have_the_hand_go_on_to_its_end() -> None:
    rivals = reported(belief(0.8, 0.0, 0.0, 0.2), leads=fixture(0.25)).rivals
    # turn-back ends along y; at its beginning it goes down.
    assert rivals[0].state == "turn-back"
    assert_allclose(rivals[0].toward, Y, atol=1e-9)


@pytest.mark.parametrize(("ratios", "expected"), [({12: -0.5}, -X), ({30: -0.5}, Z), ({}, Z)])
def test_who_explains_the_same_segment_otherwise_is_as_far_along_if_it_lives(
    ratios: dict[int, float], expected: np.ndarray[tuple[int], np.dtype[np.float64]]
) -> None:
    # 150 mm along: on the second leg of reach, which leads along y, and of lift, along −x.
    heard = evidence({"lift": ratios})
    rivals = reported(belief(0.8, 0.0, 0.2, 0.0), heard, leads=fixture(0.75)).rivals
    assert rivals[0].state == "lift"
    assert rivals[0].turn_rad == pytest.approx(np.pi / 2)
    assert_allclose(rivals[0].toward, expected, atol=1e-9)


@pytest.mark.parametrize(
    ("then", "angle_deg", "toward"),
    [
        ((np.cos(1.1), np.sin(1.1), 0.0), np.degrees(1.1), Y),
        ((0.5, 0.0, -np.sqrt(0.75)), 60.0, -Z),
        ((1.0, 0.0, 0.0), 0.0, None),
        ((-1.0, 0.0, 0.0), 180.0, None),
    ],
)
def test_a_turn_is_an_angle_and_a_side(
    then: tuple[float, float, float], angle_deg: float, toward: Any
) -> None:
    angle, side = turn(X, np.array(then))
    assert np.degrees(angle) == pytest.approx(angle_deg)
    assert (side is None) == (toward is None)
    if side is not None:
        assert_allclose(side, toward, atol=1e-9)


def test_support_is_that_of_the_gestemes_begun_with_the_segment_whoever_holds_them() -> None:
    one = evidence({"reach": {11: 9.0, 12: 0.75, 13: 9.0}})
    other = evidence({"turn": {12: -1.5, 40: 9.0}, "lift": {12: 9.0}})
    support = reported(belief(0.9, 0.1, 0.0, 0.0), one, other).support
    assert [(each.state, each.log_ratio_nats) for each in support] == [
        ("reach", 0.75),
        ("turn", -1.5),
    ]


def test_a_gesteme_that_is_held_without_that_beginning_is_ruled_out_and_one_not_held_unknown() -> (
    None
):
    heard = (evidence({"turn": {40: 1.0}}),)
    assert log_ratio(heard, "turn", 12) == (True, None)
    assert log_ratio(heard, "reach", 12) == (False, None)
    support = reported(belief(0.9, 0.1, 0.0, 0.0), *heard).support
    assert [(each.gesteme, each.log_ratio_nats) for each in support] == [("turn", None)]


def test_nothing_is_reported_where_nothing_is_believed_or_of_another_task() -> None:
    for said in (None, belief(states=(), likely_gesteme=""), belief(1.0, states=("else",))):
        assert reasons_of(said, (), None, lesson_task(), PATHS) is None
    assert reasons_of(belief(1.0, 0.0, 0.0, 0.0), (), None, None, {}) is None


def test_evidence_whose_arrays_do_not_fit_is_not_usable() -> None:
    fits = evidence({"reach": {12: 0.5}})
    assert usable(fits)
    assert usable(evidence({"reach": {}}))
    for wrong in (
        {"pair_start": np.zeros(2, dtype=np.int32)},
        {"log_ratio": np.zeros(0, dtype=np.float32)},
        {"pair_gesteme": np.array([1], dtype=np.int32)},
        {"pair_gesteme": np.array([-1], dtype=np.int32)},
    ):
        assert not usable(fits.model_copy(update=wrong))


# --- evidence of several classifiers --------------------------------------------------------------


def test_evidence_of_a_step_is_put_together_and_found_by_the_belief_it_is_for() -> None:
    known = StepEvidence()
    one, other = evidence({"reach": {}}), evidence({"turn": {}})
    for each in (one, evidence({"lift": {}}, step=42), other, evidence({"lift": {}}, clock="d")):
        known = with_evidence(known, each)
    found = evidence_of(belief(1.0, 0.0, 0.0, 0.0), known)
    assert [each.gestemes for each in found] == [("reach",), ("turn",)]
    assert evidence_of(belief(1.0, 0.0, 0.0, 0.0, model_hash="another"), known) == ()


def test_evidence_of_the_newest_steps_only_is_kept() -> None:
    known = StepEvidence()
    for step in range(100):
        known = with_evidence(known, evidence({"reach": {}}, step=step))
    assert len(known.by_step) == STEPS
    assert evidence_of(belief(1.0, 0.0, 0.0, 0.0, step=99), known)
    assert not evidence_of(belief(1.0, 0.0, 0.0, 0.0, step=99 - STEPS), known)


# --- in words -------------------------------------------------------------------------------------


def test_reasons_are_put_in_words() -> None:
    heard = evidence({"reach": {12: 0.75}, "turn": {40: 1.0}})
    said = spoken_reasons.reasons(reported(belief(0.8, 0.1, 0.0, 0.1), heard, leads=fixture(0.25)))
    for part in (
        "25% along reach's path, 150 mm to go",
        "reach +0.75 nats",
        "turn ruled out",
        "**turn** (10%, may follow) would take over after 2.1 nats more: "
        "a hand that turns 90° down (toward −z)",
        "**turn-back** (10%)",
    ):
        assert part in said


def test_only_what_is_known_is_put_in_words() -> None:
    said = spoken_reasons.reasons(reported(belief(1.0, 0.0, 0.0, 0.0)))
    assert "**turn** (0%, may follow)" in said
    for part in ("along", "nats", "hand that", "None"):
        assert part not in said
    assert spoken_reasons.reasons(None) == ""


@pytest.mark.parametrize(
    ("direction", "expected"),
    [
        ((0.0, 0.0, -1.0), "down (toward −z)"),
        ((0.0, 0.6, -0.8), "down and left (toward −z)"),
        ((-0.9, -0.43, 0.05), "right and back (toward −x)"),
        ((0.577, 0.577, 0.577), "up and left and forward (toward +x)"),
    ],
)
def test_directions_are_said_as_somebody_beside_the_robot_would(
    direction: tuple[float, float, float], expected: str
) -> None:
    assert spoken_reasons.side(np.array(direction)) == expected


def test_a_hand_goes_straight_on_or_turns_back() -> None:
    straight = {**PATHS, "turn": PATHS["reach"]}
    back = {**PATHS, "turn": Path(np.array([[0.0, 0, 0], [-0.1, 0, 0]]))}
    for paths, words in ((straight, "goes straight on"), (back, "turns back")):
        reasons = reasons_of(belief(0.9, 0.1, 0.0, 0.0), (), fixture(0.25), lesson_task(), paths)
        assert f"a hand that {words}" in spoken_reasons.reasons(reasons)
