"""The models, robots and processes that are kept with a recording."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from hmcs.bus.messages import Ask, RobotDescription, RobotState
from hmcs.recordings.foxglove_layout import LAYOUT_NAME, foxglove_layout
from hmcs.recordings.reading import RecordingContent, read
from hmcs_recorder import robots
from support.recorder import Bench, denied, pumped
from support.stack import Stack


def models_in(content: RecordingContent) -> dict[str, bytes]:
    """The models that are attached, without what else is."""
    attached = content.attachments
    return {name: attached[name] for name in attached if name.endswith(".hmcs")}


@pytest.mark.long
def test_who_was_there_and_the_models_are_kept_with_a_recording(
    stack: Stack, tmp_path: Path
) -> None:
    model = tmp_path / "models" / "mine.hmcs"
    model.parent.mkdir()
    model.write_bytes(b"a model")
    stack.watch(stack.open_bus("observer", "one"))
    stack.bring_up("input_device", "device", "--task", "human-shapes")
    bench = Bench(stack, tmp_path / "recordings", models=(model.parent,))
    bench.service.close()
    content = bench.content()
    assert models_in(content) == {"mine.hmcs": b"a model"}
    assert content.attachments[LAYOUT_NAME] == foxglove_layout()
    device = content.metadata["input_device/device"]
    assert device["task"] == "human-shapes"
    assert "dead_zone_m" in device["settings"]
    assert content.metadata["hmcs"]["cell"] == "test"


# --- what is kept with it -------------------------------------------------------------------------


def test_models_that_cannot_be_read_are_left_out_and_two_of_a_name_distinguished(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    places = [tmp_path / "one", tmp_path / "two", tmp_path / "bad"]
    for place in places:
        place.mkdir()
        (place / "mine.hmcs").write_bytes(place.name.encode())
    read_bytes = Path.read_bytes

    def broken(file: Path) -> bytes:
        return denied() if file.parent.name == "bad" else read_bytes(file)  # type: ignore[func-returns-value, return-value]

    monkeypatch.setattr(Path, "read_bytes", broken)
    bench = Bench(stack, tmp_path / "recordings", models=(*places, tmp_path / "none"))
    bench.service.close()
    monkeypatch.undo()
    assert models_in(bench.content()) == {"mine.hmcs": b"one", "mine-2.hmcs": b"two"}


class Robot:
    """Publishes states of a robot, and says how it looks where it does."""

    def __init__(self, stack: Stack, *, answers: bool) -> None:
        self.bus = stack.open_bus("robot", f"arm-{answers}")
        self._states = self.bus.publisher(RobotState, self.bus.keys.robot_state)
        robot_description = RobotDescription(
            robot="two-joints", urdf="<robot/>", joints=("waist", "elbow"), files={"a": b"mesh"}
        )
        if answers:
            self.bus.answer("looks", Ask, lambda _: robot_description)

    def state(self) -> None:
        still = np.zeros(6)
        self._states.put(
            RobotState(
                robot="two-joints",
                joint_positions=np.array([0.1, 0.2]),
                joint_velocities=np.zeros(2),
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
        )


def shown_joints(file: Path) -> list[list[str]]:
    """What viewers are shown of a robot's joints."""
    with file.open("rb") as stream:
        return [
            [joint["name"] for joint in json.loads(message.data)["joints"]]
            for _, channel, message in make_reader(stream).iter_messages()
            if channel.topic == "/foxglove/joints"
        ]


def test_joints_are_shown_by_the_names_that_the_robot_says_they_have(
    stack: Stack, tmp_path: Path
) -> None:
    """Though the robot came when it was being recorded already."""
    bench = Bench(stack, tmp_path / "recordings")
    robot = Robot(stack, answers=True)
    (file,) = bench.folder.glob("*.mcap")
    robots = bench.service._robots
    with pumped(robot.bus):
        stack.until(lambda: robot.state() or "two-joints" in robots._robot_descriptions)
        stack.until(lambda: robot.state() or not bench.service._recording.undescribed)  # type: ignore[union-attr]
        time_out = bench.bus.counters.received[RobotState.SCHEMA] + 20
        stack.until(
            lambda: robot.state() or bench.bus.counters.received[RobotState.SCHEMA] > time_out
        )
    bench.service.close()
    shown = shown_joints(file)
    assert shown[0] == []
    assert shown[-1] == ["waist", "elbow"]
    content = read(file)
    assert content.metadata["joints/two-joints"]["joints"] == "waist elbow"
    assert content.attachments["two-joints.urdf"] == b"<robot/>"


def test_that_a_robot_does_not_say_how_it_looks_is_reported_and_no_names_are_invented(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robots, "RETRY_S", 0.01)
    bench = Bench(stack, tmp_path / "recordings")
    robot = Robot(stack, answers=False)
    asked = bench.service._robots._asked
    stack.until(lambda: robot.state() or asked.get("two-joints", 0) == robots.MOST_ASKED)
    bench.service.close()
    (file,) = bench.folder.glob("*.mcap")
    assert {name for names in shown_joints(file) for name in names} == set()
    assert "gives no answer" in read(file).metadata["joints/two-joints"]["unknown"]
