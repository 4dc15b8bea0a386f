"""Deflections and buttons of a device become the motion of a hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs_input_device.devices.mapping import FOLLOW_S, Usual
from hmcs_input_device.devices.reading import DeviceReading
from hmcs_input_device.press_gate import HANG_S
from support.devices import PERIOD_S, POINTER, STICK, Desk

# --- devices whose deflection is a velocity -------------------------------------------------------


def test_full_deflection_moves_the_hand_at_full_speed_along_the_mapped_axis() -> None:
    desk = Desk(scale_m_s=0.2, axes={"x": "-ry", "y": "none", "z": "x"})
    desk.hold()
    sample = desk.tell(0.0, 1.0, 0.0, 0.0, 1.0, press="hold", times=10)
    np.testing.assert_allclose(sample.velocity, [-0.2, 0, 0])
    np.testing.assert_allclose(sample.position, [-0.2 * 10 * PERIOD_S, 0, 0])
    assert sample.dead_man
    np.testing.assert_allclose(desk.tell(1.0, press="hold").velocity, [0, 0, 0.2])


def test_dead_band_has_no_jump_and_full_deflection_stays_full() -> None:
    speeds = []
    for deflection in np.linspace(-1, 1, 401):
        desk = Desk(scale_m_s=0.1, dead_band=0.2)
        desk.hold()
        speeds.append(desk.tell(float(deflection), press="hold").velocity[0])
    assert speeds[0] == pytest.approx(-0.1)
    assert speeds[-1] == pytest.approx(0.1)
    assert np.diff(speeds).max() == pytest.approx(0.1 * 0.005 / 0.8)
    assert np.diff(speeds).min() == 0
    np.testing.assert_array_equal(speeds[161:240], 0)


def test_a_diagonal_is_no_faster_than_an_axis() -> None:
    desk = Desk(scale_m_s=0.1)
    desk.hold()
    sample = desk.tell(1.0, -1.0, 1.0, press="hold")
    assert np.linalg.norm(sample.velocity) == pytest.approx(0.1)


def test_without_the_dead_man_nothing_moves_and_letting_go_stops_at_once() -> None:
    desk = Desk()
    desk.hold()
    moving = desk.tell(1.0, press="hold", times=5)
    still = desk.tell(1.0)
    assert not still.dead_man
    np.testing.assert_array_equal(still.velocity, np.zeros(3))
    np.testing.assert_array_equal(still.position, moving.position)


def test_the_clutch_holds_the_hand_and_the_pedal_is_reported() -> None:
    desk = Desk()
    desk.hold()
    here = desk.tell(1.0, press="hold", times=5).position
    clutched = desk.tell(1.0, press="hold slip mark", times=5)
    assert (clutched.dead_man, clutched.clutch, clutched.pedal) == (True, True, True)
    np.testing.assert_array_equal(clutched.velocity, np.zeros(3))
    np.testing.assert_array_equal(clutched.position, here)
    assert not desk.tell(1.0, press="hold").clutch


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_a_reading_that_is_no_number_stops_the_hand_is_reported_and_leaves_no_trace(
    value: float,
) -> None:
    desk = Desk()
    desk.hold()
    here = desk.tell(0.5, press="hold", times=5).position
    refused = desk.tell(0.5, value, press="hold")
    assert not refused.dead_man
    np.testing.assert_array_equal(refused.velocity, np.zeros(3))
    np.testing.assert_array_equal(refused.position, here)
    assert f"gives {value} for its axis y" in desk.source.trouble
    assert not desk.tell(press="hold", times=100).dead_man
    assert "let go of it and press it anew" in desk.source.trouble
    desk.hold()
    assert desk.tell(0.5, press="hold").velocity[0] > 0
    assert desk.source.trouble == ""


def test_a_device_of_too_few_axes_moves_nothing_and_says_so() -> None:
    desk = Desk()
    desk.hold()
    desk.device.says = DeviceReading((1.0,), frozenset({"hold"}))
    np.testing.assert_array_equal(desk.ask(3).velocity, np.zeros(3))
    assert "has 1 axes, expected 6" in desk.source.trouble


def test_a_deflection_out_of_range_counts_as_full() -> None:
    desk = Desk(scale_m_s=0.1)
    desk.hold()
    desk.tell(0.9, press="hold")
    assert desk.tell(1e9, press="hold").velocity[0] == pytest.approx(0.1)


def test_a_jump_moves_nothing_until_it_stays() -> None:
    desk = Desk(jump=0.5)
    desk.hold()
    np.testing.assert_array_equal(desk.tell(0.6, press="hold").velocity, np.zeros(3))
    assert desk.tell(0.6, press="hold").velocity[0] > 0
    np.testing.assert_array_equal(desk.tell(-0.6, press="hold").velocity, np.zeros(3))
    assert desk.tell(-0.6, press="hold").velocity[0] < 0


def test_an_axis_that_goes_from_end_to_end_at_once_is_broken_unless_it_is_a_switch() -> None:
    desk = Desk()
    desk.hold()
    desk.tell(1.0, press="hold", times=5)
    broken = desk.tell(-1.0, press="hold")
    assert not broken.dead_man
    assert "jumped by 2.00" in desk.source.trouble
    assert not desk.tell(-1.0, press="hold", times=5).dead_man
    keys = Desk(STICK._replace(switches=True))
    keys.hold()
    keys.tell(1.0, press="hold", times=5)
    keys.tell(-1.0, press="hold")
    assert keys.tell(-1.0, press="hold").velocity[0] < 0


def test_a_process_that_hung_does_not_make_up_for_it() -> None:
    desk = Desk(scale_m_s=0.1)
    desk.hold()
    here = desk.tell(1.0, press="hold").position
    desk.now_s += 10.0
    assert np.linalg.norm(desk.ask().position - here) <= 0.1 * FOLLOW_S + 1e-12


@pytest.mark.parametrize("jump_s", [HANG_S + 0.01, 10.0, -10.0])
def test_after_a_hang_or_a_jump_of_the_clock_the_dead_man_has_to_be_pressed_anew(
    jump_s: float,
) -> None:
    desk = Desk()
    desk.hold()
    here = desk.tell(0.5, press="hold", times=10).position
    desk.now_s += jump_s
    assert not desk.tell(0.51, press="hold").dead_man
    # Let go of and pressed meanwhile: what queued up in the hang is not believed.
    desk.hold()
    still = desk.tell(0.01, press="hold", times=round(1.0 / PERIOD_S))
    assert not still.dead_man
    assert "hung or its clock jumped" in desk.source.trouble
    np.testing.assert_array_equal(still.position, here)
    desk.hold()
    assert desk.tell(0.5, press="hold").velocity[0] > 0


# --- what holds whatever a device says ------------------------------------------------------------


_ANY = st.floats(allow_nan=True, allow_infinity=True) | st.floats(-1.5, 1.5)
_READING = st.builds(
    DeviceReading,
    st.tuples(*[_ANY] * 6),
    st.frozensets(st.sampled_from(["hold", "slip", "mark", "other"]))
    | st.just(frozenset({"hold"})),
    st.none() | st.tuples(_ANY, _ANY) | st.tuples(st.integers(-50, 50), st.integers(-50, 50)),
)


@pytest.mark.long
@given(
    usual=st.sampled_from([STICK, POINTER]),
    scale_m_s=st.floats(0.01, 0.5),
    dead_band=st.floats(0.0, 0.9),
    ticks=st.lists(st.tuples(st.none() | _READING, st.floats(0.0, 0.2)), max_size=40),
)
def test_never_too_fast_never_without_dead_man_and_always_its_own_integral(
    usual: Usual,
    scale_m_s: float,
    dead_band: float,
    ticks: list[tuple[DeviceReading | None, float]],
) -> None:
    desk = Desk(usual, scale_m_s=scale_m_s, dead_band=dead_band)
    before = desk.source.sample(desk.now_s)
    for reading, period_s in ticks:
        desk.device.says = reading
        desk.now_s += period_s
        sample = desk.source.sample(desk.now_s)
        assert np.isfinite(sample.position).all()
        assert np.linalg.norm(sample.velocity) <= scale_m_s * (1 + 1e-9)
        way = sample.velocity * min(period_s, FOLLOW_S)
        np.testing.assert_allclose(sample.position, before.position + way, atol=1e-12)
        held = reading is not None and {"hold"} <= reading.buttons and "slip" not in reading.buttons
        if not held or not sample.dead_man:
            np.testing.assert_array_equal(sample.velocity, np.zeros(3))
        before = sample
