"""A stop of the robot holds until the operator lets go and takes hold again."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import Ask, Done, Motion, RobotState
from hmcs.bus.session import Bus, Received
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import steps_of
from support.hand_device import Hand, press, seen

MakeDesk = Callable[..., Any]


class Robot:
    """Follows while the dead-man is held, after a stop only once it was released."""

    def __init__(self, bus: Bus) -> None:
        self.may_follow = False
        self.stands = False
        self.asked_until_s = 0.0
        self._states = bus.publisher(RobotState, bus.keys.robot_state)
        bus.subscribe(Motion, bus.keys.motion, self._on_motion)

    def stop(self) -> None:
        self.may_follow = False

    def ask_to_stop(self) -> None:
        """As `hmcs stop` does; reported for half a second, or until it moves again."""
        self.may_follow = False
        self.asked_until_s = time.monotonic() + 0.5

    def _on_motion(self, received: Received[Motion]) -> None:
        held = received.body.dead_man
        self.may_follow = self.may_follow or not held
        self.stands = not (self.may_follow and held)
        if not self.stands:
            self.asked_until_s = 0.0
        findings = self.asked_until_s and (held or time.monotonic() < self.asked_until_s)
        stop = "asked" if findings else "stale_command" if self.stands else "none"
        self._states.put(
            RobotState(
                robot="fake",
                joint_positions=np.zeros(6),
                joint_velocities=np.zeros(6),
                tool_position=np.zeros(3),
                tool_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
                tool_twist=np.zeros(6),
                reference_twist=np.zeros(6),
                nearest_obstacle="",
                nearest_distance_m=None,
                contacts=(),
                stop=stop,
                limited=(),
            )
        )


@pytest.mark.long
@pytest.mark.parametrize("re_engage", [True, False])
def test_operator_of_a_recording_lets_go_and_presses_again_when_the_robot_stands(
    play: MakeDesk, line: Demonstration, re_engage: bool
) -> None:
    desk = play(re_engage=re_engage, lead_in_s=0.5, speed=0.5, autoplay=False)
    robot = Robot(desk.open_bus("robot"))
    desk.ask("play", Ask(), Done)
    desk.until(lambda: len(desk.steps) >= 3, "steps")
    assert not robot.stands
    robot.stop()
    desk.until_finished()
    held = [received.body.dead_man for received in desk.motions]
    assert int(np.diff(np.array(held, dtype=int)).clip(0).sum()) == 1 + re_engage
    assert desk.service.facts()["re_engagements"] == str(int(re_engage))
    # A tick that a busy machine skips makes a step one sample longer, and no motion is lost.
    expected = steps_of(line.positions, 0.02)
    assert len(desk.steps) == pytest.approx(len(expected), abs=1)
    assert [received.body.index for received in desk.steps] == list(range(len(desk.steps)))
    sampled = {received.envelope.seq: received.body for received in desk.motions}
    for received in desk.steps:
        origin = received.envelope.origin
        assert received.body.displacement[1] < 0.05
        if origin.seq in sampled:
            np.testing.assert_allclose(
                received.body.position + received.body.displacement,
                sampled[origin.seq].position,
                atol=1e-9,
            )


@pytest.mark.long
@pytest.mark.parametrize("source", ["recorded", "synthetic", "simulated"])
@pytest.mark.parametrize("re_engage", [True, False])
def test_a_stop_that_was_asked_for_holds_until_a_person_asks_to_play(
    make_desk: MakeDesk,
    line_file: Path,
    caplog: pytest.LogCaptureFixture,
    source: str,
    re_engage: bool,
) -> None:
    recorded = {"demonstration": line_file, "repeat": 0, "speed": 0.5}
    desk = make_desk(
        source=source,
        re_engage=re_engage,
        lead_in_s=0.3,
        rate_hz=100.0,
        dead_zone_m=0.02,
        autoplay=False,
        **(recorded if source == "recorded" else {"repeat": 0} if source == "synthetic" else {}),
    )
    robot = Robot(desk.open_bus("robot"))
    assert "from its beginning" in desk.ask("play", Ask(), Done).detail
    desk.until(lambda: len(desk.steps) >= 2, "steps")
    for _ in range(2):
        stop_and_go_on(desk, robot)
    assert caplog.text.count("lets go, as a stop was asked for") == 2
    assert [received.body.index for received in desk.steps] == list(range(len(desk.steps)))
    assert max(np.linalg.norm(received.body.displacement) for received in desk.steps) < 0.1


def stop_and_go_on(desk: Any, robot: Robot) -> None:
    """Ask for a stop, look for long that it holds, and ask to play."""
    before_s = float(desk.service.facts()["played_s"])
    robot.ask_to_stop()
    desk.until(lambda: desk.service.facts()["stopped"] == "x", "the stop to be heard")
    healthy, detail = desk.service.health()
    assert healthy
    assert detail.startswith("stopped: x was asked to stand; goes on when it is asked to play")
    desk.until(lambda: not desk.motions[-1].body.dead_man, "the hand to let go")
    count, steps = len(desk.motions), len(desk.steps)
    # Longer than a played operator takes to react, and than a pass with its lead-in.
    until_s = time.monotonic() + 2.0
    desk.until(lambda: time.monotonic() > until_s, "time to pass")
    assert len(desk.motions) > count
    assert not any(received.body.dead_man for received in desk.motions[count:])
    assert not any(received.body.velocity.any() for received in desk.motions[count:])
    assert len(desk.steps) == steps
    assert "takes hold again and goes on at" in desk.ask("play", Ask(), Done).detail
    desk.until(lambda: not robot.stands, "the robot to follow again")
    assert desk.service.facts()["stopped"] == ""
    desk.until(lambda: len(desk.steps) > steps + 1, "steps where it goes on")
    assert float(desk.service.facts()["played_s"]) >= before_s


def test_a_stop_before_it_plays_is_not_undone_by_its_own_beginning(play: MakeDesk) -> None:
    desk = play(wait_for=("robot",), re_engage=True)
    robot_bus = desk.open_bus("robot")
    robot = Robot(robot_bus)
    robot.ask_to_stop()
    desk.until(lambda: desk.service.facts()["stopped"] == "x", "the stop to be heard")
    desk.listener.announce(desk.listener.keys.presence("robot", "x"))
    count = len(desk.motions)
    desk.until(lambda: len(desk.motions) > count + 100, "time to begin")
    assert not any(received.body.dead_man for received in desk.motions)
    assert "from its beginning" in desk.ask("play", Ask(), Done).detail
    desk.until(lambda: not robot.stands, "the robot to follow")


def test_what_is_no_robot_of_the_cell_stops_nothing(play: MakeDesk) -> None:
    desk = play(repeat=0)
    desk.listener.announce(desk.listener.keys.presence("robot", "true"))
    stranger = Robot(desk.open_bus("robot"))
    desk.until(lambda: "robot" in str(desk.service._present), "the robot's token")
    stranger.ask_to_stop()
    count = len(desk.motions)
    desk.until(lambda: len(desk.motions) > count + 50, "time to pass")
    assert desk.service.facts()["stopped"] == ""


def test_after_its_end_a_stop_is_ended_by_playing_anew(play: MakeDesk) -> None:
    desk = play()
    robot = Robot(desk.open_bus("robot"))
    desk.until_finished()
    robot.ask_to_stop()
    desk.until(lambda: desk.service.facts()["stopped"] == "x", "the stop to be heard")
    steps = len(desk.steps)
    assert "from its beginning" in desk.ask("play", Ask(), Done).detail
    desk.until(lambda: len(desk.steps) > steps, "steps")


def test_a_hand_that_is_there_ends_a_stop_by_itself(make_desk: MakeDesk, hand: Hand) -> None:
    """A person lets go and takes hold again; nobody else has to be asked."""
    desk = make_desk(source="hand")
    robot = Robot(desk.open_bus("robot"))
    press(desk, hand)
    robot.ask_to_stop()
    seen(desk)
    assert robot.stands
    assert desk.motions[-1].body.dead_man
    assert desk.service.facts()["stopped"] == ""
    press(desk, hand)
    desk.until(lambda: not robot.stands, "the robot to follow")
