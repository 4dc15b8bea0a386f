from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from hmcs.driving import (
    PAIRING_FRESH_S,
    PAIRINGS_KEPT,
    STANDBY_DEVICES,
    TAKEOVER_S,
    Device,
    FollowingRobot,
    Pairings,
    heard_device,
    heard_robot,
)


class Story:
    """Samples of devices at 100 Hz."""

    def __init__(self) -> None:
        self.device, self.now_s = Device(), 0.0

    def hear(self, seconds: float, **pressed: bool) -> str:
        """Hear the named devices for a time; return who drives then."""
        for _ in range(round(seconds * 100)):
            self.now_s += 0.01
            for boot, down in pressed.items():
                self.device = heard_device(self.device, self.now_s, boot, boot, pressed=down)
        return self.device.boot


def test_the_first_device_heard_drives() -> None:
    assert Story().hear(0.1, a=False) == "a"


def test_a_device_that_holds_its_dead_man_is_not_taken_over_from() -> None:
    story = Story()
    story.hear(1.0, a=True)
    story.hear(1.0, a=True, b=False)
    assert story.hear(5.0, a=True, b=True) == "a"


def test_an_idle_device_gives_way_to_a_deliberate_press_of_another() -> None:
    story = Story()
    story.hear(1.0, a=False, b=False)
    assert story.hear(0.02, a=False, b=True) == "b"
    assert story.device.deliberate


def test_a_dead_man_that_was_never_seen_up_takes_over_from_no_idle_device() -> None:
    story = Story()
    story.hear(1.0, a=False)
    assert story.hear(5.0, a=False, b=True) == "a"


def test_a_device_that_has_just_let_go_keeps_driving() -> None:
    story = Story()
    story.hear(1.0, a=True, b=False)
    story.hear(TAKEOVER_S / 2, a=False, b=False)
    assert story.hear(0.02, a=False, b=True) == "a"


def test_a_silent_device_is_taken_over_from_and_the_press_is_not_taken_for_deliberate() -> None:
    story = Story()
    story.hear(1.0, a=True, b=True)
    assert story.hear(TAKEOVER_S - 0.02, b=True) == "a"
    assert story.hear(0.05, b=True) == "b"
    assert not story.device.deliberate


@given(st.lists(st.tuples(st.sampled_from("abcdef"), st.booleans(), st.integers(0, 80))))
def test_whoever_drives_was_heard_within_the_takeover_time_or_nobody_else_was(events) -> None:
    device, now_s, last = Device(), 0.0, {}
    for boot, pressed, wait in events:
        now_s += wait / 100
        before = device
        device = heard_device(device, now_s, boot, boot, pressed=pressed)
        last[boot] = now_s
        assert device.heard_s == last[device.boot]
        if device.boot != before.boot and before.boot:
            assert before.silent(now_s) or (before.released_s is not None and pressed)
        assert device.boot not in device.standby


def test_made_up_devices_do_not_pile_up() -> None:
    device = Device()
    for number in range(1000):
        device = heard_device(device, 0.0, str(number), "x", pressed=False)
    assert device.boot == "0"
    assert len(device.standby) == STANDBY_DEVICES


# --- robots ---------------------------------------------------------------------------------------


def test_the_first_robot_heard_follows_and_a_second_one_does_not() -> None:
    robot = FollowingRobot()
    for now_s in (0.0, 0.1, 0.2):
        robot = heard_robot(robot, now_s, "A", "one", {"one", "two"})
        robot = heard_robot(robot, now_s, "B", "two", {"one", "two"})
    assert robot.boot == "A"


def test_a_robot_without_a_presence_token_is_a_stranger_where_others_show_one() -> None:
    assert heard_robot(FollowingRobot(), 0.0, "A", "stranger", {"one"}).boot == ""
    assert heard_robot(FollowingRobot(), 0.0, "A", "one", ()).boot == "A"


def test_a_robot_that_goes_gives_way_at_once_and_one_that_hangs_after_a_while() -> None:
    robot = heard_robot(FollowingRobot(), 0.0, "A", "one", {"one", "two"})
    assert heard_robot(robot, 0.01, "B", "two", {"two"}).boot == "B"
    assert heard_robot(robot, TAKEOVER_S, "B", "two", {"one", "two"}).boot == "A"
    assert heard_robot(robot, TAKEOVER_S + 0.01, "B", "two", {"one", "two"}).boot == "B"


def test_a_robot_that_started_anew_under_its_name_follows_once_the_old_one_is_silent() -> None:
    robot = heard_robot(FollowingRobot(), 0.0, "A", "one", {"one"})
    assert heard_robot(robot, 0.1, "B", "one", {"one"}).boot == "A"
    assert heard_robot(robot, 0.6, "B", "one", {"one"}).boot == "B"


def test_a_robot_knows_which_writer_drives_another_one_and_for_how_long() -> None:
    pairings = Pairings()
    assert pairings.other_than("me", "f", 0.0) == ""
    pairings.heard("f", "other", 1.0)
    assert pairings.other_than("me", "f", 1.0 + PAIRING_FRESH_S) == "other"
    assert pairings.other_than("other", "f", 1.0) == ""
    assert pairings.other_than("me", "f", 1.1 + PAIRING_FRESH_S) == ""
    pairings.heard("f", "me", 3.0)
    assert pairings.other_than("me", "f", 3.0) == ""


def test_of_many_writers_the_last_ones_are_remembered() -> None:
    pairings = Pairings()
    pairings.heard("first", "other", 0.0)
    for k in range(PAIRINGS_KEPT - 1):
        pairings.heard(f"f{k}", "other", 0.0)
    pairings.heard("first", "other", 0.0)
    pairings.heard("last", "other", 0.0)
    assert pairings.other_than("me", "first", 0.0) == "other"
    assert pairings.other_than("me", "f0", 0.0) == ""
