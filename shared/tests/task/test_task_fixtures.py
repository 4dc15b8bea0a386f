"""What a task file says of the fixture: contradictions are reported with line and field."""

from __future__ import annotations

import pytest

from support.task_files import GOOD, Check


@pytest.mark.parametrize(
    ("fixture", "says"),
    [
        ("volume: {knots: [{progress: 0, radius_m: 0.002}]}", "below dead_zone_m"),
        (
            "volume: {knots: [{progress: 0.5, radius_m: 0.1}, {progress: 0.2, radius_m: 0.1}]}",
            "rising",
        ),
        ("compliance: optimal", "no lines"),
        ("law: soft", "general"),
    ],
)
def test_a_fixture_that_cannot_be_is_reported_with_its_line(
    check: Check, fixture: str, says: str
) -> None:
    (problem,) = check(f"{GOOD}fixture:\n  {fixture}\n")
    assert says in problem.message
    assert problem.line >= GOOD.count("\n")


@pytest.mark.parametrize(
    ("fixture", "says"),
    [
        ("shared: {operator_axes: [vx]}", "need a plan"),
        ("plan: {}, shared: {operator_axes: [vx, vx]}", "each once"),
        ("plan: {}, target: {position_m: [0, 0, 0.5]}", "give one of them"),
        ("volume: {knots: []}", "no radius"),
    ],
)
def test_a_states_fixture_that_contradicts_itself_is_reported(
    check: Check, fixture: str, says: str
) -> None:
    text = GOOD.replace("    next: [fall]", f"    next: [fall]\n    fixture: {{{fixture}}}")
    (problem,) = check(text)
    assert says in problem.message
    assert problem.path.startswith("states[0].fixture")


def test_a_state_may_go_by_a_plan_or_to_a_target(check: Check) -> None:
    for fixture in (
        "plan: {speed_m_s: 0.03}, shared: {operator_axes: [vx, wz]}",
        "target: {position_m: [0, 0, 0.5], orientation_xyzw: [0, 0, 0, 1]}",
        "compliance: cue, cue: {cue: pedal, scaling: hold}",
    ):
        text = GOOD.replace("    next: [fall]", f"    next: [fall]\n    fixture: {{{fixture}}}")
        assert check(text) == []


def test_an_axis_both_shared_and_blocked_is_reported(check: Check) -> None:
    shared = "plan: {}, shared: {operator_axes: [vx, wz]}"
    text = GOOD.replace("    next: [fall]", f"    next: [fall]\n    fixture: {{{shared}}}")
    (problem,) = check(f"{text}fixture:\n  axis_scale: [1, 1, 1, 1, 1, 0]\n")
    assert "wz is the operator's" in problem.message
    assert problem.path == "states[0].fixture.shared.operator_axes"
