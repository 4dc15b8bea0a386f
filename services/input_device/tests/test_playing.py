"""When a source plays, and that a stop which was asked for holds until a person ends it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs_input_device.playing import GIVES_WAY_S, ROBOTS, Playing
from hmcs_input_device.reaction import HEARD_WITHIN_S, RELEASED_S

RATE_HZ = 100.0
PERIOD_S = 1.0 / RATE_HZ


class Robot:
    """A robot that tells at every tick why it stands, as the real one does."""

    TELLS_S = 0.5

    def __init__(self, name: str) -> None:
        self.name, self.boot = name, f"{name}-1"
        self.present = True
        self.asked = self.armed = False
        self.tells_for_s = 0.0

    def sees(self, *, held: bool) -> None:
        self.tells_for_s -= PERIOD_S
        if not held:
            self.armed = True
            self.asked = self.asked and self.tells_for_s > 0.0
        elif self.armed:
            self.asked = self.armed = False

    def stop(self) -> None:
        self.asked, self.armed, self.tells_for_s = True, False, self.TELLS_S


class Desk:
    """A source that plays, looked at a hundred times a second, and robots that follow it."""

    def __init__(self, *robots: Robot, minds_stops: bool = True) -> None:
        self.playing = Playing(RATE_HZ, minds_stops=minds_stops)
        self.robots = robots or (Robot("robot"),)
        self.now_s = 100.0
        self.held: list[bool] = []
        self.elapsed: list[float] = []

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * RATE_HZ)):
            self.now_s += PERIOD_S
            self.playing.on_timeout(self.now_s)
            elapsed_s = self.playing.elapsed_s(self.now_s)
            held = elapsed_s is not None and not self.playing.rests
            self.held.append(held)
            self.elapsed.append(elapsed_s or 0.0)
            for robot in self.robots:
                if robot.present:
                    robot.sees(held=held)
                    self.playing.robot_told(self.now_s, robot.boot, robot.name, asked=robot.asked)

    def begin(self) -> None:
        self.playing.begin(self.now_s)
        self.run(1.0)
        assert self.moves

    @property
    def moves(self) -> bool:
        return self.held[-1] and not any(robot.asked for robot in self.robots)


def test_a_stop_that_was_asked_for_holds_for_ever_and_playing_goes_on_where_it_let_go() -> None:
    desk = Desk()
    desk.begin()
    desk.robots[0].stop()
    desk.run(300.0)
    assert not any(desk.held[-29_900:])
    assert desk.playing.stopped == "robot"
    at_s = desk.elapsed[-1]
    assert at_s == pytest.approx(1.0, abs=2 * PERIOD_S)
    desk.playing.go_on(desk.now_s)
    desk.run(5.0)
    assert desk.playing.stopped == ""
    assert desk.moves
    resumed = [e for e, held in zip(desk.elapsed[-500:], desk.held[-500:], strict=True) if held]
    assert resumed[0] == pytest.approx(at_s, abs=2 * PERIOD_S)
    assert resumed[-1] == pytest.approx(at_s + 5.0, abs=3 * PERIOD_S)


@pytest.mark.parametrize("after_s", [PERIOD_S, 0.3])
@pytest.mark.parametrize("tells_s", [0.0, 0.5])
def test_on_going_on_everybody_has_seen_the_hand_let_go_first(
    after_s: float, tells_s: float
) -> None:
    desk = Desk()
    desk.begin()
    desk.robots[0].TELLS_S = tells_s
    desk.robots[0].stop()
    desk.run(after_s)
    desk.playing.go_on(desk.now_s)
    desk.run(2.0)
    assert desk.moves
    assert desk.held[-200:].count(False) >= (RELEASED_S - after_s) * RATE_HZ - 2


@pytest.mark.parametrize("after_s", [0.1, 5.0])
def test_a_stop_that_is_asked_for_again_while_it_waits_changes_nothing(after_s: float) -> None:
    desk = Desk()
    desk.begin()
    for _ in range(3):
        desk.robots[0].stop()
        desk.run(after_s)
        assert not desk.held[-1]
    desk.playing.go_on(desk.now_s)
    desk.run(3.0)
    assert desk.moves


@pytest.mark.parametrize(
    ("waited_s", "after_s"), [(2.0, 0.0), (2.0, 0.1), (0.3, 0.3), (0.1, 10.0), (2.0, 10.0)]
)
def test_a_stop_after_it_was_to_go_on_holds_as_the_first_one_did(
    waited_s: float, after_s: float
) -> None:
    """Also one that comes before the hand has taken hold again."""
    desk = Desk()
    desk.begin()
    desk.robots[0].stop()
    desk.run(waited_s)
    desk.playing.go_on(desk.now_s)
    desk.run(after_s)
    desk.robots[0].stop()
    desk.run(60.0)
    assert not desk.held[-1]
    assert desk.playing.stopped == "robot"


def test_a_robot_that_goes_on_saying_that_it_was_asked_is_not_moved() -> None:
    desk = Desk()
    desk.begin()
    desk.robots[0].TELLS_S = 1e9
    desk.robots[0].stop()
    desk.run(1.0)
    desk.playing.go_on(desk.now_s)
    desk.run(GIVES_WAY_S + 1.0)
    assert not any(desk.held[-300:])
    assert desk.playing.stopped == "robot"


def test_a_robot_that_is_gone_is_not_waited_for() -> None:
    desk = Desk()
    desk.begin()
    desk.robots[0].stop()
    desk.run(0.2)
    desk.robots[0].present = False
    desk.run(10.0)
    assert desk.playing.stopped == "robot"
    desk.playing.go_on(desk.now_s)
    desk.run(HEARD_WITHIN_S + RELEASED_S)
    assert desk.held[-1]


def test_one_of_several_robots_is_enough_and_one_that_is_asked_later_stops_it_anew() -> None:
    one, other = Robot("one"), Robot("other")
    desk = Desk(one, other)
    desk.begin()
    other.stop()
    desk.run(1.0)
    assert desk.playing.stopped == "other"
    desk.playing.go_on(desk.now_s)
    desk.run(0.1)
    one.stop()
    desk.run(0.1)
    assert desk.playing.stopped == "one"
    desk.run(60.0)
    assert not desk.held[-1]


def test_a_robot_that_starts_anew_or_another_that_moves_does_not_end_a_stop() -> None:
    desk = Desk()
    desk.begin()
    desk.robots[0].stop()
    desk.run(1.0)
    desk.robots[0].boot, desk.robots[0].asked = "robot-2", False
    desk.playing.robot_told(desk.now_s, "stranger", "stranger", asked=False)
    desk.run(60.0)
    assert desk.playing.stopped == "robot"
    desk.playing.go_on(desk.now_s)
    desk.run(2.0)
    assert desk.moves


@pytest.mark.parametrize("waited_s", [0.1, 1.0])
def test_a_stop_before_it_plays_keeps_it_from_beginning_and_beginning_ends_it(
    waited_s: float,
) -> None:
    desk = Desk()
    desk.run(1.0)
    desk.robots[0].stop()
    desk.run(waited_s)
    assert desk.playing.stopped == "robot"
    assert desk.playing.elapsed_s(desk.now_s) is None
    desk.playing.begin(desk.now_s)
    desk.run(2.0)
    assert desk.moves
    first = desk.held.index(True)
    assert desk.elapsed[first] == pytest.approx(0.0, abs=PERIOD_S)
    assert not any(desk.held[:first])


def test_a_stop_in_the_moment_it_begins_keeps_it_from_taking_hold() -> None:
    desk = Desk()
    desk.playing.begin(desk.now_s)
    desk.robots[0].stop()
    desk.playing.robot_told(desk.now_s, "robot-1", "robot", asked=True)
    desk.run(60.0)
    assert not any(desk.held)


def test_a_hand_that_is_there_is_not_held_by_a_stop() -> None:
    desk = Desk(minds_stops=False)
    desk.begin()
    desk.robots[0].stop()
    desk.run(1.0)
    assert desk.held[-1]
    assert desk.playing.stopped == ""


def test_of_any_number_of_robots_little_is_kept() -> None:
    desk = Desk()
    for k in range(20 * ROBOTS):
        desk.playing.robot_told(desk.now_s, f"boot-{k}", "robot", asked=True)
    assert len(desk.playing._asked) == ROBOTS


@given(st.lists(st.sampled_from(["stop", "go on", "wait", "wait"]), max_size=30))
def test_time_never_goes_back_nor_jumps_and_stands_still_while_it_waits(acts: list[str]) -> None:
    desk = Desk()
    desk.begin()
    for act in acts:
        if act == "stop":
            desk.robots[0].stop()
        elif act == "go on" and desk.playing.stopped:
            desk.playing.go_on(desk.now_s)
        begin = len(desk.elapsed)
        desk.run(0.3)
        for k in range(begin, len(desk.elapsed)):
            moved_s = desk.elapsed[k] - desk.elapsed[k - 1]
            assert -1e-9 <= moved_s <= 1.5 * PERIOD_S
        assert desk.elapsed[-1] == pytest.approx(
            PERIOD_S * sum(desk.held), abs=(2 + 2 * len(acts)) * PERIOD_S
        )
