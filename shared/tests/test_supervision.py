from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.supervision import (
    Order,
    Policy,
    Supervision,
    Verdict,
    accept,
    heard,
    silent,
    stopped,
    tick,
    unpaired,
)

MS = 1_000_000
POLICY = Policy(
    longest_valid_ns=100 * MS, late_tick_ns=10_000 * MS, hang_ns=100 * MS, settle_ns=250 * MS
)
TWIST = np.array([0.1, 0, 0, 0, 0, 0.2])


class Story:
    """Tells a supervision what happens, at times in ms."""

    def __init__(self) -> None:
        self.now = Supervision()

    def order(self, at_ms: int, engaged: bool, writer: str = "a", valid_ms: int = 100) -> Verdict:
        order = Order(writer, TWIST, valid_ms * MS, engaged, at_ms * MS)
        self.now, verdict = accept(self.now, order, at_ms * MS, POLICY)
        return verdict

    def tick(self, at_ms: int, *contacts: str, refused: bool = False) -> str:
        self.now = heard(self.now, at_ms * MS, POLICY)
        self.now = tick(self.now, contacts, at_ms * MS, POLICY, refused=refused)
        return self.now.stop

    def engage(self, at_ms: int = 0, writer: str = "a") -> None:
        self.tick(at_ms)
        self.order(at_ms, False, writer)
        self.order(at_ms, True, writer)
        assert self.tick(at_ms) == "none"


def test_it_stands_until_it_has_seen_a_release_and_then_an_engage() -> None:
    story = Story()
    assert story.tick(0) == "no_command"
    assert story.order(1, True) == "accepted"
    assert story.tick(2) == "no_command"
    assert not story.now.twist.any()
    story.order(3, False)
    assert story.tick(4) == "disengaged"
    story.order(5, True)
    assert story.tick(6) == "none"
    assert story.now.twist is TWIST


def test_a_stale_command_stops_and_only_a_new_engage_resumes() -> None:
    story = Story()
    story.engage()
    assert story.tick(100) == "none"
    assert story.tick(101) == "stale_command"
    assert not story.now.twist.any()
    story.order(110, True)
    assert story.tick(111) == "stale_command"
    story.order(120, False)
    story.order(130, True)
    assert story.tick(131) == "none"


def test_a_command_is_as_fresh_as_its_arrival_not_as_its_handling() -> None:
    story = Story()
    story.engage()
    story.tick(50)
    order = Order("a", TWIST, 100 * MS, True, 10 * MS)
    story.now, _ = accept(story.now, order, 60 * MS, POLICY)
    assert story.tick(110) == "none"
    assert story.tick(111) == "stale_command"
    late = Order("a", TWIST, 100 * MS, False, 10 * MS)
    assert accept(story.now, late, 120 * MS, POLICY)[1] == "late"


def test_a_stale_command_after_refused_ones_is_reported_as_refused() -> None:
    story = Story()
    story.engage()
    assert story.tick(50, refused=True) == "none"
    assert story.tick(101, refused=True) == "refused_command"


def test_a_second_writer_is_refused_while_the_first_is_fresh() -> None:
    story = Story()
    story.engage()
    for engaged in (False, True):
        assert story.order(50, engaged, writer="b") == "second_writer"
    assert story.tick(60) == "none"
    assert story.now.writer == "a"


def test_another_writer_takes_over_from_a_dead_one_by_an_engage_of_its_own() -> None:
    story = Story()
    story.engage()
    story.tick(90)
    assert story.tick(120) == "stale_command"
    assert story.order(121, True, writer="b") == "accepted"
    assert story.tick(122) == "second_writer"
    story.order(130, False, writer="b")
    story.order(140, True, writer="b")
    assert story.tick(141) == "none"
    assert story.order(142, True, writer="a") == "second_writer"


def test_a_release_seen_from_the_old_writer_does_not_engage_the_new_one() -> None:
    story = Story()
    story.engage()
    story.order(10, False)
    story.tick(90)
    story.tick(120)
    story.order(121, True, writer="b")
    assert story.tick(122) == "second_writer"


def test_a_collision_stops_and_after_a_new_engage_the_same_contact_does_not() -> None:
    story = Story()
    story.engage()
    assert story.tick(1, "post") == "collision"
    story.order(50, True)
    assert story.tick(51, "post") == "collision"
    story.order(60, False)
    story.order(70, True)
    assert story.tick(71, "post") == "none"
    assert story.tick(72, "post", "wall") == "collision"


def test_a_collision_stays_the_reason_when_the_commands_end() -> None:
    story = Story()
    story.engage()
    story.tick(1, "post")
    story.tick(90, "post")
    assert story.tick(180, "post") == "collision"


def test_whoever_asks_stops_it_until_the_operator_lets_go_and_takes_hold_again() -> None:
    story = Story()
    story.engage()
    story.now = stopped(story.now)
    assert story.tick(1) == "asked"
    assert not story.now.twist.any()
    story.order(50, True)
    assert story.tick(90) == "asked"
    assert story.tick(180) == "asked"
    story.order(190, False)
    story.order(200, True)
    assert story.tick(201) == "none"


def test_a_stop_that_was_asked_for_is_shown_for_a_while_also_where_nobody_drives() -> None:
    story = Story()
    story.engage()
    story.order(1, False)
    assert story.tick(2) == "disengaged"
    story.now = stopped(story.now)
    for at_ms in range(10, 500, 10):
        story.order(at_ms, False)
        assert story.tick(at_ms) == "asked"
    story.order(510, False)
    assert story.tick(511) == "disengaged"
    story.now = stopped(story.now)
    story.order(520, False)
    story.order(530, True)
    assert story.tick(531) == "none"


def test_a_hang_of_the_wire_room_stops_and_refuses_what_queued_up() -> None:
    story = Story()
    story.engage()
    story.tick(50)
    # It wakes 450 ms later; a release and an engage of long ago lie in the queue.
    assert story.order(500, False) == "late"
    assert story.order(500, True) == "late"
    assert story.tick(501) == "stale_command"
    for at_ms in range(550, 750, 50):
        story.tick(at_ms)
        assert story.order(at_ms, False) == "late"
        assert story.order(at_ms, True) == "late"
    story.tick(760)
    assert story.order(760, True) == "accepted"
    assert story.tick(761) == "stale_command"
    story.order(770, False)
    story.order(780, True)
    assert story.tick(781) == "none"


def test_no_command_counts_longer_than_the_robot_lets_it() -> None:
    story = Story()
    story.tick(0)
    story.order(0, False, valid_ms=1000)
    story.order(0, True, valid_ms=1000)
    assert story.tick(100) == "none"
    assert story.tick(101) == "stale_command"


def test_a_late_control_tick_is_a_stop_that_only_a_new_engage_ends() -> None:
    patient = Policy(late_tick_ns=50 * MS, longest_valid_ns=100 * MS)
    now = Supervision()
    for at_ms, engaged in ((0, False), (1, True)):
        now, _ = accept(now, Order("a", TWIST, 100 * MS, engaged, at_ms * MS), at_ms * MS, patient)
    now = tick(now, (), 1 * MS, patient)
    now = tick(now, (), 51 * MS, patient)
    assert now.stop == "none"
    now, _ = accept(now, Order("a", TWIST, 100 * MS, True, 60 * MS), 60 * MS, patient)
    now = tick(now, (), 102 * MS, patient)
    assert now.stop == "late_tick"
    now, _ = accept(now, Order("a", TWIST, 100 * MS, True, 103 * MS), 103 * MS, patient)
    assert tick(now, (), 104 * MS, patient).stop == "late_tick"


def test_a_silent_arm_stands_until_it_is_heard_and_the_operator_takes_hold_again() -> None:
    story = Story()
    story.engage()
    story.now = silent(story.now)
    assert story.tick(1) == "silent_arm"
    assert not story.now.twist.any()
    assert story.tick(101) == "silent_arm", "also once its commands are stale"
    story.order(102, True)
    assert story.tick(103) == "silent_arm"
    story.order(104, False)
    story.order(105, True)
    assert story.tick(106) == "none"


def test_a_writer_that_drives_another_robot_stops_this_one_and_others_do_not() -> None:
    story = Story()
    story.engage()
    story.now = unpaired(story.now, "b")
    assert story.tick(1) == "none"
    story.now = unpaired(story.now, "a")
    assert story.tick(2) == "not_paired"
    story.order(3, True)
    assert story.tick(4) == "not_paired"


orders = st.tuples(st.sampled_from("ab"), st.booleans(), st.sampled_from([20, 100]))
contacts = st.sampled_from([frozenset(), frozenset({"post"}), frozenset({"post", "wall"})])
events = st.lists(st.tuples(st.integers(1, 90), st.one_of(orders, contacts)), max_size=60)


@given(events)
def test_it_moves_only_on_the_fresh_word_of_one_writer_that_released_and_engaged(
    history: list[tuple[int, Any]],
) -> None:
    """Against the rule itself, from the whole history instead of from a state."""
    story = Story()
    story.tick(0)
    at_ms = 0
    touched: tuple[str, ...] = ()
    accepted: list[tuple[int, str, bool, int]] = []
    last_stop_ms = -1
    for pause_ms, event in history:
        at_ms += pause_ms
        if isinstance(event, tuple):
            writer, engaged, valid_ms = event
            if story.order(at_ms, engaged, writer, valid_ms) == "accepted":
                accepted.append((at_ms, writer, engaged, valid_ms))
        else:
            if event - set(touched) and story.now.stop == "none":
                last_stop_ms = at_ms
            touched = tuple(sorted(event))
        stop = story.tick(at_ms, *touched)
        if stop != "none":
            assert not story.now.twist.any()
            continue
        writer = accepted[-1][1]
        own: list[tuple[int, bool]] = []
        until_ms = at_ms
        for then_ms, who, engaged, valid_ms in reversed(accepted):
            if who != writer or then_ms + valid_ms < until_ms:
                break
            own.insert(0, (then_ms, engaged))
            until_ms = then_ms
        since = [engaged for then_ms, engaged in own if then_ms > last_stop_ms]
        assert since[-1] is True
        assert False in since


@pytest.mark.parametrize("engaged", [True, False])
def test_a_command_that_waited_too_long_is_late(engaged: bool) -> None:
    order = Order("a", TWIST, 100 * MS, engaged, 0)
    after, verdict = accept(Supervision(), order, 101 * MS, POLICY)
    assert verdict == "late"
    assert after.writer is None
