"""What viewers are shown of messages, and what they are not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import Envelope, Motion, RobotState, Source
from hmcs.bus.wire import encode
from hmcs.recordings.foxglove import MOST_UNDESCRIBED, FoxgloveConverter, FoxgloveMessage
from hmcs.recordings.json_codec import fields_of

ROBOT = Source(service="robot", instance="r", boot="b")


def state(robot: str = "arm", names: tuple[str, ...] = ()) -> dict[str, Any]:
    still = np.zeros(6)
    body = RobotState(
        robot=robot,
        joint_names=names,
        joint_positions=np.array([0.1, 0.2]),
        joint_velocities=np.array([0.0, 1.0]),
        tool_position=np.zeros(3),
        tool_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        tool_twist=still,
        reference_twist=still,
        nearest_obstacle="",
        nearest_distance_m=None,
        contacts=(),
        stop="none",
        limited=(),
    )
    return fields_of(encode(body, Envelope(source=ROBOT, seq=0)))


def joints(shown: list[FoxgloveMessage]) -> list[dict[str, Any]]:
    (states,) = [each for each in shown if each.schema == "foxglove.JointStates"]
    found = states.fields["joints"]
    assert isinstance(found, list)
    return found


def test_joints_have_the_names_that_the_state_has() -> None:
    shown = joints(list(FoxgloveConverter().of(state(names=("waist", "elbow")), 1)))
    assert shown == [
        {"name": "waist", "position": 0.1, "velocity": 0.0},
        {"name": "elbow", "position": 0.2, "velocity": 1.0},
    ]


def test_joints_have_the_names_of_the_description_where_the_state_has_none() -> None:
    showing = FoxgloveConverter()
    assert joints(list(showing.of(state(), 1))) == []
    assert showing.undescribed == {"arm"}
    showing.name_joints("arm", ("waist", "elbow"))
    named = joints(list(showing.of(state(), 10**9)))
    assert [joint["name"] for joint in named] == ["waist", "elbow"]
    assert showing.undescribed == set()


@pytest.mark.parametrize("names", [("waist",), ("a", "b", "c"), ()])
def test_names_that_do_not_fit_are_not_shown_and_none_are_invented(names: tuple[str, ...]) -> None:
    showing = FoxgloveConverter()
    showing.name_joints("arm", names)
    assert joints(list(showing.of(state(), 1))) == []


def test_a_state_of_the_version_before_is_shown_too() -> None:
    fields = state()
    del fields["joint_names"]
    assert joints(list(FoxgloveConverter().of(fields, 1))) == []


def test_so_many_robots_are_noted_and_no_more() -> None:
    showing = FoxgloveConverter()
    for number in range(100):
        list(showing.of(state(f"robot-{number}"), number * 10**9))
    assert len(showing.undescribed) == MOST_UNDESCRIBED


def test_a_hand_without_orientation_is_shown_upright() -> None:
    motion = Motion(position=np.ones(3), velocity=np.zeros(3), dead_man=True)
    fields = fields_of(encode(motion, Envelope(source=ROBOT, seq=0)))
    for left_out in ((), ("orientation", "wrench", "origin", "clutch")):
        reported = {name: value for name, value in fields.items() if name not in left_out}
        (shown,) = FoxgloveConverter().of(reported, 1)
        assert shown.fields["pose"]["orientation"] == {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
