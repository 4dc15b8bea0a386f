"""The handle of a page as a device."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.messages import Handle
from hmcs.fixtures.controller.engagement import Engagement
from hmcs_input_device.held import FASTEST_M_S, JUMP_M, HeldHandle
from hmcs_input_device.press_gate import HANG_S, SETTLE_S, SILENT_S
from hmcs_input_device.sources import FARTHEST_M, DeviceSample

PERIOD_S = 0.01


def handle(x_m: float, operator: str = "page-1", **changes: bool) -> Handle:
    said = {"dead_man": True, **changes}
    return Handle.model_construct(
        operator=operator,
        position=np.array([x_m, 0.0, 0.0]),
        **{"clutch": False, "pedal": False, **said},
    )


class Desk:
    """A device asked a hundred times a second, pages that speak to it, and a fixture behind it."""

    def __init__(self) -> None:
        self.device, self.now_s = HeldHandle(), 10.0
        self.fixture = Engagement(0.1, 0.25)
        self.drives = False

    def ask(self) -> DeviceSample:
        self.now_s += PERIOD_S
        self.device.seconds(self.now_s)
        sample = self.device.sample(0.0)
        self.drives = (
            self.fixture.on_sample(self.now_s, sample.dead_man, sample.clutch) == "driving"
        )
        return sample

    def run(
        self, seconds: float, said: Handle | None = None, every_s: float = 0.033
    ) -> list[DeviceSample]:
        samples, next_s = [], self.now_s
        for _ in range(round(seconds / PERIOD_S)):
            if said is not None and self.now_s >= next_s:
                assert self.device.handled(self.now_s, said)
                next_s += every_s
            samples.append(self.ask())
        return samples

    def take_hold(self, x_m: float = 0.0, operator: str = "page-1", seconds: float = 0.2) -> None:
        """As a page does: it tells that the handle is let go of, and then holds it."""
        assert self.device.handled(self.now_s, handle(x_m, operator, dead_man=False))
        self.ask()
        assert self.run(seconds, handle(x_m, operator))[-1].dead_man
        assert self.drives
        assert self.device.trouble == ""


def test_the_hand_follows_the_handle_and_its_velocity_is_that_of_its_way() -> None:
    desk = Desk()
    desk.take_hold()
    samples = desk.run(1.0, handle(0.1))
    assert samples[-1].dead_man
    np.testing.assert_allclose(samples[-1].position, [0.1, 0, 0], atol=1e-4)
    way = sum(sample.velocity for sample in samples) * PERIOD_S
    np.testing.assert_allclose(way, samples[-1].position - [0.0, 0, 0], atol=1e-6)
    assert max(np.linalg.norm(s.velocity) for s in samples) <= FASTEST_M_S + 1e-9


def test_pressing_elsewhere_does_not_jump() -> None:
    desk = Desk()
    desk.take_hold()
    before = desk.run(0.5, handle(0.05))[-1].position
    desk.run(0.5, handle(0.05, dead_man=False))
    pressed = desk.run(0.1, handle(0.4))
    assert pressed[-1].dead_man
    np.testing.assert_allclose(pressed[-1].position, before, atol=1e-9)


def test_a_handle_that_goes_far_is_followed_no_faster_than_a_hand() -> None:
    desk = Desk()
    desk.take_hold()
    samples = desk.run(0.2, handle(1.0))
    speeds = [np.linalg.norm(sample.velocity) for sample in samples]
    assert max(speeds) == pytest.approx(FASTEST_M_S)
    assert FASTEST_M_S <= 0.5


def test_while_clutched_the_handle_is_repositioned_and_the_hand_is_not() -> None:
    desk = Desk()
    desk.take_hold()
    here = desk.run(0.5, handle(0.05))[-1].position
    clutched = desk.run(0.3, handle(0.3, clutch=True))
    assert clutched[-1].clutch
    np.testing.assert_allclose(clutched[-1].position, here, atol=1e-9)
    np.testing.assert_allclose(desk.run(0.2, handle(0.3))[-1].position, here, atol=1e-9)


# --- only a deliberate press moves ----------------------------------------------------------------


def assert_needs_a_new_press(desk: Desk, x_m: float = 0.05, operator: str = "page-1") -> None:
    """Nothing moves however long the page tells that it holds; letting go and pressing does it."""
    still = desk.run(1.0, handle(x_m, operator))
    assert not any(sample.dead_man or sample.velocity.any() for sample in still[1:])
    assert not desk.drives
    assert "let go of" in desk.device.trouble
    desk.take_hold(x_m, operator)


@pytest.mark.parametrize("silence_s", [SILENT_S + 0.02, 0.5, 60.0])
def test_a_page_that_falls_silent_lets_go_and_holds_again_only_when_taken_hold_of_anew(
    silence_s: float,
) -> None:
    desk = Desk()
    desk.take_hold(0.05)
    here = desk.run(0.3, handle(0.05))[-1].position
    silent = desk.run(silence_s)
    assert PERIOD_S * sum(sample.dead_man for sample in silent) <= SILENT_S + PERIOD_S
    np.testing.assert_array_equal(silent[-1].velocity, np.zeros(3))
    assert "fell silent" in desk.device.trouble
    assert_needs_a_new_press(desk)
    np.testing.assert_allclose(desk.ask().position, here, atol=1e-9)


def test_a_page_that_is_late_now_and_then_is_not_silent() -> None:
    desk = Desk()
    desk.take_hold()
    assert all(sample.dead_man for sample in desk.run(2.0, handle(0.0), SILENT_S - 0.02))


def test_a_handle_that_was_held_when_it_was_first_heard_moves_nothing() -> None:
    assert_needs_a_new_press(Desk())


def test_a_second_page_cannot_operate_until_the_first_has_let_go() -> None:
    desk = Desk()
    desk.take_hold()
    assert not desk.device.handled(desk.now_s, handle(0.3, "page-2"))
    assert "another page holds the handle" in desk.device.refusal
    desk.run(2 * SILENT_S)
    desk.take_hold(0.3, "page-2")


@pytest.mark.parametrize("lets_go", [True, False])
def test_a_page_that_takes_over_has_to_take_hold_anew(lets_go: bool) -> None:
    """It held its handle all the time, and was refused; the other one let go, or fell silent."""
    desk = Desk()
    desk.take_hold()
    assert not desk.device.handled(desk.now_s, handle(0.3, "page-2", dead_man=False))
    assert not desk.device.handled(desk.now_s, handle(0.3, "page-2"))
    desk.run(0.2, handle(0.0, dead_man=False) if lets_go else None)
    assert_needs_a_new_press(desk, 0.3, "page-2")


def test_a_release_between_two_samples_is_seen() -> None:
    desk = Desk()
    desk.take_hold()
    desk.run(1.0)
    desk.run(0.1, handle(0.0))
    for said in (handle(0.0, dead_man=False), handle(0.0)):
        assert desk.device.handled(desk.now_s, said)
    assert not desk.ask().dead_man
    assert desk.ask().dead_man
    assert desk.drives


@pytest.mark.parametrize("jump_s", [HANG_S + 0.02, 5.0, -5.0, -1e9, 1e9])
def test_after_a_hang_or_a_jump_of_the_clock_it_has_to_be_taken_hold_of_anew(jump_s: float) -> None:
    desk = Desk()
    desk.take_hold(0.05)
    desk.now_s += jump_s
    desk.fixture = Engagement(0.1, 0.25)
    assert not desk.run(PERIOD_S, handle(0.05))[0].dead_man
    desk.run(SETTLE_S, handle(0.05))
    assert_needs_a_new_press(desk)


def test_a_clock_that_is_set_back_lets_nobody_hold_for_ever() -> None:
    desk = Desk()
    desk.take_hold()
    desk.now_s -= 1e6
    desk.fixture = Engagement(0.1, 0.25)
    desk.run(SETTLE_S + 0.1)
    desk.take_hold(0.3, "page-2")


# --- numbers no hand makes ------------------------------------------------------------------------


@pytest.mark.parametrize(
    "x_m", [1e308, -1e308, 1.01 * FARTHEST_M, float("nan"), float("inf"), -float("inf")]
)
def test_a_handle_out_of_reach_is_refused_and_leaves_no_trace(x_m: float) -> None:
    desk = Desk()
    desk.take_hold(0.05)
    here = desk.run(0.3, handle(0.05))[-1].position
    for sign in (1, -1, 1, -1):
        assert not desk.device.handled(desk.now_s, handle(sign * x_m))
        assert "farther than 10000 m" in desk.device.refusal
        still = desk.ask()
        assert not still.dead_man
        np.testing.assert_allclose(still.position, here, atol=1e-9)
    assert_needs_a_new_press(desk)


def test_a_strangers_handle_out_of_reach_disturbs_nobody() -> None:
    desk = Desk()
    desk.take_hold()
    assert not desk.device.handled(desk.now_s, handle(1e308, "stranger"))
    assert desk.ask().dead_man
    desk.run(0.2, handle(0.0, dead_man=False))
    assert not desk.device.handled(desk.now_s, handle(1e308, "stranger"))
    assert desk.device.trouble == ""


def test_a_handle_that_jumps_farther_than_a_hand_can_has_to_be_taken_hold_of_anew() -> None:
    desk = Desk()
    desk.take_hold()
    assert not desk.run(0.1, handle(1.1 * JUMP_M))[0].dead_man
    assert_needs_a_new_press(desk, 1.1 * JUMP_M)


_POSITION = st.floats(-1e5, 1e5) | st.floats(-0.1, 0.1) | st.sampled_from([1e308, -1e308])
_SAID = st.builds(
    handle,
    _POSITION,
    st.sampled_from(["page-1", "page-2", "x" * 64, "\x1b[2J<script>"]),
    dead_man=st.booleans(),
    clutch=st.booleans(),
)


@given(st.lists(st.tuples(st.lists(_SAID, max_size=3), st.floats(-0.5, 0.5)), max_size=40))
def test_whatever_pages_say_the_hand_is_finite_no_faster_than_a_hand_and_moves_only_when_pressed(
    ticks: list[tuple[list[Handle], float]],
) -> None:
    desk = Desk()
    before, released = desk.ask(), True
    for said, jump_s in ticks:
        desk.now_s += jump_s
        for one in said:
            desk.device.handled(desk.now_s, one)
        sample = desk.ask()
        assert np.abs(sample.position).max() <= FARTHEST_M
        assert np.linalg.norm(sample.velocity) <= FASTEST_M_S + 1e-9
        assert np.linalg.norm(sample.position - before.position) <= FASTEST_M_S * 0.08 + 1e-9
        if not sample.dead_man:
            np.testing.assert_array_equal(sample.velocity, np.zeros(3))
        assert not sample.dead_man or before.dead_man or released
        released = any(not one.dead_man for one in said) or not sample.dead_man
        before = sample
    desk.now_s += 10.0
    desk.run(0.5)
    desk.run(0.5, handle(0.0, "page-9", dead_man=False))
    desk.take_hold(0.0, "page-9")
