"""The rule of all dead-man's switches: pure, the time is passed in."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.fixtures.controller.rules import Safeguards
from hmcs_input_device.press_gate import HANG_S, SETTLE_S, PressGate

PERIOD_S = 0.01


class Hand:
    """A hand on a switch that is looked at a hundred times a second."""

    def __init__(self, **settings: bool) -> None:
        self.gate, self.now_s = PressGate("hold", **settings), 5.0

    def does(self, pressed: bool, trouble: str = "", times: int = 1) -> bool:
        for _ in range(times):
            self.now_s += PERIOD_S
            passes = self.gate.passes(self.now_s, pressed, trouble)
        return passes

    def presses_anew(self) -> bool:
        return not self.does(False) and self.does(True)


def test_a_switch_that_is_held_from_the_first_look_on_counts_once_it_was_let_go_of() -> None:
    hand = Hand()
    assert not hand.does(True, times=1000)
    assert "hold is held since before it counted (it was held when it was first seen)" in (
        hand.gate.trouble
    )
    assert hand.presses_anew()
    assert hand.gate.trouble == ""
    assert hand.does(True, times=1000)


@pytest.mark.parametrize("held_meanwhile", [True, False])
def test_trouble_stops_at_once_and_only_a_press_after_it_ends_that(held_meanwhile: bool) -> None:
    hand = Hand()
    assert hand.presses_anew()
    assert not hand.does(held_meanwhile, "pad is gone: plug it in", times=10)
    assert hand.gate.trouble == "pad is gone: plug it in"
    assert not hand.does(True, times=1000)
    assert "(pad is gone)" in hand.gate.trouble
    assert "let go of it and press it anew" in hand.gate.trouble
    assert hand.presses_anew()


def test_a_release_in_the_midst_of_trouble_is_none() -> None:
    hand = Hand()
    hand.presses_anew()
    hand.does(True, "silent: wait")
    hand.does(False, "silent: wait")
    assert not hand.does(True)


@pytest.mark.parametrize("jump_s", [HANG_S + PERIOD_S, 1e9, -PERIOD_S, -1e9, float("nan")])
def test_after_a_hang_or_a_jump_of_the_clock_what_queued_up_is_not_believed(jump_s: float) -> None:
    hand = Hand()
    assert hand.presses_anew()
    began_s = hand.now_s
    assert not hand.gate.passes(began_s + jump_s, True)
    hand.now_s = began_s + jump_s if jump_s == jump_s else began_s
    assert not hand.presses_anew()
    assert not hand.does(True, times=round(2 * SETTLE_S / PERIOD_S))
    assert "hung or its clock jumped" in hand.gate.trouble
    assert hand.presses_anew()


def test_what_is_a_hang_here_is_one_for_the_fixture_too() -> None:
    assert Safeguards().input_stale_after_s >= HANG_S
    assert Safeguards().settle_s <= SETTLE_S


def test_a_short_delay_is_no_hang() -> None:
    hand = Hand()
    assert hand.presses_anew()
    hand.now_s += HANG_S - 2 * PERIOD_S
    assert hand.does(True)


def test_a_source_whose_own_time_stands_still_minds_no_hang() -> None:
    hand = Hand(minds_hangs=False)
    assert hand.presses_anew()
    hand.now_s += 100.0
    assert hand.does(True)


def test_it_can_be_shut_from_outside() -> None:
    hand = Hand()
    assert hand.presses_anew()
    hand.gate.shut("it was held before it was to play")
    assert hand.gate.trouble == ""
    assert not hand.does(True)
    assert "before it was to play" in hand.gate.trouble
    assert hand.presses_anew()


@given(
    st.lists(
        st.tuples(st.booleans(), st.sampled_from(["", "", "gone: wait"]), st.floats(-0.05, 0.3)),
        max_size=60,
    )
)
def test_it_never_opens_but_by_a_release_and_a_press_without_trouble_between(
    ticks: list[tuple[bool, str, float]],
) -> None:
    gate, now_s, passed, released = PressGate("hold"), 0.0, False, False
    for number, (pressed, trouble, apart_s) in enumerate(ticks):
        before_s, now_s = now_s, now_s + apart_s
        hung = number > 0 and not 0.0 <= now_s - before_s <= HANG_S
        passes = gate.passes(now_s, pressed, trouble)
        assert not (passes and (trouble or hung or not pressed))
        assert not passes or passed or released
        released = not pressed and not trouble and (released or not hung)
        passed = passes
        assert (gate.trouble == "") or not passes
