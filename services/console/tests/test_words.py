from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest

from hmcs.bus.keys import Member
from hmcs.bus.messages import Belief, FixtureState, Health, RobotState, TrainingProgress
from hmcs.recognizer_takeover import Agreement
from hmcs_console.order import Order
from hmcs_console.seeing.marking import Marking
from hmcs_console.telling import words


def belief(**fields: Any) -> Belief:
    said: dict[str, Any] = {
        "model_hash": "h",
        "clock": "c",
        "step": 41,
        "states": ("free", "in"),
        "probabilities": np.array([0.125, 0.75]),
        "unknown": 0.125,
        "likely_gesteme": "line",
        "segment_start": 12,
        "log_likelihood": -0.5,
        "mean_log_likelihood": 0.25,
    }
    return Belief(**(said | fields))


def fixture(**fields: Any) -> FixtureState:
    said: dict[str, Any] = {
        "law": "general",
        "model": "lines",
        "state": "in",
        "factor": 0.5,
        "compliance": 0.25,
        "preferred_direction": np.zeros(3),
        "progress": 0.75,
        "gesteme": "line",
        "off_guide_m": 0.004,
        "operator_twist": np.zeros(6),
        "command_twist": np.zeros(6),
        "wrench": np.zeros(6),
        "engaged": True,
        "reason": "guiding",
    }
    return FixtureState(**(said | fields))


def robot(**fields: Any) -> RobotState:
    said: dict[str, Any] = {
        "robot": "puma560",
        "joint_positions": np.zeros(6),
        "joint_velocities": np.zeros(6),
        "tool_position": np.zeros(3),
        "tool_orientation": np.array([0.0, 0.0, 0.0, 1.0]),
        "tool_twist": np.zeros(6),
        "reference_twist": np.zeros(6),
        "nearest_obstacle": "post",
        "nearest_distance_m": 0.062,
        "contacts": (),
        "stop": "none",
        "limited": ("speed",),
    }
    return RobotState(**(said | fields))


def health(**fields: Any) -> Health:
    said: dict[str, Any] = {
        "healthy": True,
        "detail": "runs",
        "uptime_s": 1.0,
        "loop_rate_hz": 99.6,
        "cpu_s": 1.0,
        "received": {},
        "sent": {},
        "lost": {"step": 1, "motion": 2},
        "refused": {"belief": 4},
        "late": {},
    }
    return Health(**(said | fields))


def test_why_names_what_is_likely_and_what_it_stands_on() -> None:
    said = words.why(belief())
    for part in ("**in** 75%", "unknown 12%", "gesteme line", "since step 12 of 41", "-0.50"):
        assert part in said
    assert "missing" not in said
    assert "alarm" not in said


def test_why_tells_an_alarm_and_missing_evidence() -> None:
    said = words.why(belief(unknown_alarm=True, missing_gestemes=("arc", "bow")))
    assert "alarm" in said
    assert "no evidence of arc, bow" in said


def test_why_says_so_where_nothing_is_recognized() -> None:
    assert "Nothing is recognized" in words.why(None)
    assert "Nothing is recognized" in words.why(belief(states=(), probabilities=np.zeros(0)))


@pytest.mark.parametrize("reason", get_args(FixtureState.model_fields["reason"].annotation))
def test_every_reason_of_a_fixture_is_put_in_words(reason: str) -> None:
    assert "compliance 0.25" in words.doing(fixture(reason=reason), None)


def test_doing_tells_law_guide_and_robot() -> None:
    said = words.doing(fixture(asks_for_help=True), robot(contacts=("post",)))
    for part in (
        "75% along line, 4.0 mm beside it",
        "help it on",
        "puma560 follows, limited by speed",
        "62 mm from post",
        "**touches** post",
    ):
        assert part in said


def test_doing_tells_why_a_robot_stands_and_who_is_not_heard() -> None:
    assert "**stands**: stale command" in words.doing(None, robot(stop="stale_command"))
    asked = words.doing(None, robot(stop="asked"))
    assert "**stands**: asked to, until its operator lets go and takes hold again" in asked
    assert "No fixture controller" in words.doing(None, None)
    assert "No robot" in words.doing(None, None)


def test_recognizers_tell_who_is_followed_and_how_others_agree() -> None:
    said = words.recognizers("lines", {"one": Agreement(3, 4), "two": Agreement(0, 0)})
    assert "follows **lines**" in said
    assert "one agrees in 75% of 4 steps" in said
    assert "two has no step in common" in said


def test_services_tell_how_they_are_and_what_was_lost_late_and_refused() -> None:
    said = words.services(
        {
            Member("robot", "a"): health(),
            Member("task_hmm", "b"): None,
            Member("trainer", "c"): health(healthy=False, detail="stuck"),
        }
    )
    table, *doing = said.split("\n\n")
    head, _, *rows = table.splitlines()
    assert head == "| process | | lost | refused | late |"
    assert rows[-1].startswith("| robot/a |")
    assert rows[-1].endswith("ok | 3 | 4 | 0 |")
    assert [row.count("ill") for row in rows] == [1, 1, 0]
    assert "ill: present, but does not answer" in doing[0]
    assert "**trainer/c**: ill: stuck" in doing
    assert doing[-1] == "**robot/a**: runs"
    assert "nobody is there" in words.services({})


def test_a_training_tells_its_stage_and_where_the_model_is() -> None:
    progress = TrainingProgress(
        model="mine", stage="done", detail="learned", share=1.0, path="/m/mine.hmcs"
    )
    assert words.training(progress).endswith("/m/mine.hmcs")
    assert "No training" in words.training(None)


def test_how_to_engage_let_go_clutch_and_stop_is_reported() -> None:
    for part in ("Engage", "dead-man", "Let go", "Clutch", "Stop", "Keep to", "Scale"):
        assert part in words.operating()


def test_a_running_recording_is_named_without_its_folder() -> None:
    assert words.recording("/data/takes/show-1.mcap").endswith("**recording** to show-1.mcap")
    assert words.recording("") == ""


def test_what_is_marked_and_what_the_pedal_would_mark_is_reported() -> None:
    order = Order("take", {"take": {"set": 1.0}, "set": {}})
    assert words.marking(Marking(order, True)) == (
        "nothing is marked; the pedal (key P) begins **take**"
    )
    assert "now **set**; the pedal (key P) ends the task" in words.marking(
        Marking(order, True, "set")
    )
    assert words.marking(Marking(order, False, "take")) == "now **take**"
    assert "give the console a task" in words.marking(Marking(None, True))
