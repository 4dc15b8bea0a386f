"""Devices a hand moves, through the interface of a source and with a device that is made up."""

from __future__ import annotations

import sys
from collections.abc import Callable
from itertools import count
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.errors import UserError
from hmcs.task import load_task
from hmcs_input_device import service as service_module
from hmcs_input_device.devices.detect import found
from hmcs_input_device.devices.device_source import REST_WITHIN_S, DeviceSource
from hmcs_input_device.devices.keyboard import Keyboard
from hmcs_input_device.devices.kinds import KINDS
from hmcs_input_device.devices.mapping import FOLLOW_S, AxisMap, Buttons, Usual, rules_of
from hmcs_input_device.devices.mouse import Mouse
from hmcs_input_device.devices.reading import DeviceReading, UnpluggedError
from hmcs_input_device.played import BUILT_IN
from hmcs_input_device.press_gate import HANG_S, SILENT_S
from hmcs_input_device.settings import DeviceSettings, InputDeviceSettings
from hmcs_input_device.sources import DeviceSample, Troubled, open_source

TASK = load_task("human-shapes")
PERIOD_S = 0.01
STICK = Usual("rate", AxisMap("x", "y", "z"), Buttons("hold", "slip", "mark"))
POINTER = Usual("position", AxisMap("none", "-x", "y"), STICK.buttons, has=("x", "y"))


class Fake:
    """A device that says what it is told to."""

    name = "stick"

    def __init__(self) -> None:
        self.says: DeviceReading | UnpluggedError | None = DeviceReading((0.0,) * 6)
        self.closed = False

    def read(self) -> DeviceReading | None:
        if isinstance(self.says, UnpluggedError):
            raise self.says
        return self.says

    def close(self) -> None:
        self.closed = True


class Desk:
    """A device asked a hundred times a second."""

    def __init__(
        self, usual: Usual = STICK, comes_at: tuple[float, ...] = (), **settings: Any
    ) -> None:
        self.device, self.now_s = Fake(), 5.0
        rules = rules_of(DeviceSettings(**settings), usual)
        self.source = DeviceSource(self.device, rules, lambda: self.now_s)
        self.tell(*comes_at)

    def tell(
        self,
        *axes: float,
        press: str = "",
        pointer: tuple[float, float] | None = (0.0, 0.0),
        times: int = 1,
    ) -> DeviceSample:
        """Let it say this so many times; return the last sample."""
        filled = (*axes, *(0.0,) * (6 - len(axes)))
        self.device.says = DeviceReading(filled, frozenset(press.split()), pointer)
        return self.ask(times)

    def ask(self, times: int = 1) -> DeviceSample:
        for _ in range(times):
            self.now_s += PERIOD_S
            sample = self.source.sample(self.now_s)
        return sample

    def hold(self) -> None:
        """Let go of everything, then press the dead-man."""
        self.tell()
        self.tell(press="hold")


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


def test_the_clutch_holds_the_hand_and_the_pedal_is_told() -> None:
    desk = Desk()
    desk.hold()
    here = desk.tell(1.0, press="hold", times=5).position
    clutched = desk.tell(1.0, press="hold slip mark", times=5)
    assert (clutched.dead_man, clutched.clutch, clutched.pedal) == (True, True, True)
    np.testing.assert_array_equal(clutched.velocity, np.zeros(3))
    np.testing.assert_array_equal(clutched.position, here)
    assert not desk.tell(1.0, press="hold").clutch


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_a_reading_that_is_no_number_stops_the_hand_is_told_and_leaves_no_trace(
    value: float,
) -> None:
    desk = Desk()
    desk.hold()
    here = desk.tell(0.5, press="hold", times=5).position
    refused = desk.tell(0.5, value, press="hold")
    assert not refused.dead_man
    np.testing.assert_array_equal(refused.velocity, np.zeros(3))
    np.testing.assert_array_equal(refused.position, here)
    assert f"tells {value} for its axis y" in desk.source.trouble
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
    assert "tells 1 axes, expected 6" in desk.source.trouble


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


# --- axes that do not rest ------------------------------------------------------------------------


def assert_stays(desk: Desk, *axes: float, seconds: float = 0.9) -> None:
    """The hand does not move while the dead-man is held: less long than silence is told of."""
    here = desk.source.sample(desk.now_s).position
    still = desk.tell(*axes, press="hold", times=round(seconds / PERIOD_S))
    assert not still.dead_man
    np.testing.assert_array_equal(still.position, here)


@pytest.mark.parametrize("rest", [0.99, -1.0, 1.0, 0.12, -0.2])
def test_an_axis_that_was_never_at_rest_moves_nothing_and_is_named(rest: float) -> None:
    """A gamepad before it is touched, a throttle or trigger that rests at an end, a worn stick."""
    desk = Desk(comes_at=(0.0, rest))
    assert f"has not been at rest since it came, see axis y ({rest:.2f})" in desk.source.trouble
    assert_stays(desk, 0.0, rest)
    assert_stays(desk, 0.5, rest)
    desk.tell()
    assert desk.source.trouble == ""
    desk.hold()
    assert desk.tell(0.5, press="hold").velocity[0] > 0


def test_a_trigger_that_rests_at_an_end_moves_nothing_also_after_it_was_pulled() -> None:
    desk = Desk()
    pulled = [*np.linspace(-1, 1, 21), *np.linspace(1, -1, 21)]
    for press in ("", "hold", ""):
        for value in pulled:
            desk.tell(float(value), press=press)
        desk.tell(-1.0, times=round(2 * REST_WITHIN_S / PERIOD_S))
        assert_stays(desk, -1.0)
        assert "was not at rest when hold was pressed, see axis x (-1.00)" in desk.source.trouble
        desk.tell(-1.0)


def test_a_stick_that_drifts_after_it_was_let_go_of_moves_nothing_and_says_what_to_do() -> None:
    desk = Desk()
    desk.hold()
    desk.tell(1.0, press="hold", times=10)
    for drift in np.linspace(0.0, 0.15, 200):
        desk.tell(float(drift))
    desk.tell(0.15, times=100)
    assert desk.source.trouble == ""
    assert_stays(desk, 0.15)
    assert "where it drifts, widen device.dead_band" in desk.source.trouble


@pytest.mark.parametrize("dead_band", [0.0, 0.1])
def test_pressing_the_dead_man_may_push_the_stick(dead_band: float) -> None:
    desk = Desk(dead_band=dead_band, comes_at=(0.04,))
    assert desk.source.trouble == ""
    assert desk.tell(0.3, press="hold").dead_man
    assert desk.tell(0.3, press="hold").velocity[0] > 0
    late = Desk()
    late.tell(0.5, times=round(0.8 * REST_WITHIN_S / PERIOD_S))
    assert late.tell(0.5, press="hold").dead_man


def test_an_axis_that_moves_nothing_may_be_anywhere() -> None:
    desk = Desk(comes_at=(0.0, 0.0, 0.0, 1.0, -1.0, 0.7))
    desk.tell(0.0, 0.0, 0.0, 1.0, -1.0, 0.7)
    desk.tell(0.0, 0.0, 0.0, 1.0, -1.0, 0.7, press="hold")
    assert desk.tell(0.5, 0.0, 0.0, 1.0, -1.0, 0.7, press="hold").velocity[0] > 0
    assert desk.source.trouble == ""


# --- devices that fall silent ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("axis", "silence_s"), [(0.5, 0.3), (0.0, 4.0)], ids=["deflected", "at rest"]
)
@pytest.mark.parametrize("tells_reports", [True, False])
def test_a_device_whose_last_values_stand_for_ever_is_let_go_of_and_has_to_be_pressed_anew(
    axis: float, silence_s: float, tells_reports: bool
) -> None:
    desk = Desk(deflected_silence_s=0.3, resting_silence_s=4.0)
    desk.hold()
    report = 0.0
    for k in range(round(2 * silence_s / PERIOD_S)):
        # Where the library tells no reports, a hand that trembles shows that it lives.
        report, shown = report + 1.0, axis + (0.0 if tells_reports else 0.001 * (k % 2))
        reading = DeviceReading((shown,) + (0.0,) * 5, frozenset({"hold"}), (0.0, 0.0))
        desk.device.says = reading._replace(report=report if tells_reports else None)
        moving = desk.ask()
    assert moving.dead_man
    silent = [desk.ask() for _ in range(round((silence_s + 2.0) / PERIOD_S))]
    held_s = PERIOD_S * sum(sample.dead_man for sample in silent)
    assert held_s == pytest.approx(silence_s, abs=2 * PERIOD_S)
    assert "stick is silent while hold is held" in desk.source.trouble
    np.testing.assert_array_equal(silent[-1].velocity, np.zeros(3))
    # A new report alone is not enough, nor is a press it tells of.
    assert not desk.tell(0.02, press="hold").dead_man
    assert not desk.tell(0.5, press="hold").dead_man
    desk.hold()
    assert desk.tell(press="hold").dead_man


def test_a_device_at_rest_with_its_dead_man_up_may_be_silent_for_ever() -> None:
    desk = Desk()
    desk.ask(6000)
    assert desk.source.trouble == ""
    assert desk.tell(press="hold").dead_man


def test_what_silence_means_is_known_of_every_device() -> None:
    usual = {kind.name: kind.usual.silence for kind in KINDS}
    assert usual["spacemouse"].deflected_s == SILENT_S
    for silence in usual.values():
        # At 0.5 m/s, the fastest setting, a device that is lost goes on by less than a meter.
        assert silence.deflected_s <= 2.0
        assert silence.resting_s <= 10.0


# --- devices whose way is the hand's --------------------------------------------------------------


def test_a_pointers_way_is_the_hands_in_the_plane_of_the_map() -> None:
    desk = Desk(POINTER, m_per_pixel=0.001, scale_m_s=0.5)
    desk.hold()
    for pixel in range(1, 41):
        desk.tell(press="hold", pointer=(pixel, pixel / 2))
    sample = desk.tell(press="hold", pointer=(40, 20), times=200)
    np.testing.assert_allclose(sample.position, [0, -0.04, 0.02], atol=1e-6)
    np.testing.assert_allclose(sample.velocity, np.zeros(3), atol=1e-6)


def test_a_pointer_is_brought_back_with_clutch_or_dead_man_up_and_the_hand_stays() -> None:
    desk = Desk(POINTER)
    desk.hold()
    here = desk.tell(press="hold", pointer=(10, 0), times=300).position
    for press in ("hold slip", ""):
        desk.tell(press=press, pointer=(100, 0))
        desk.tell(press=press, pointer=(150, 0))
        sample = desk.tell(press="hold", pointer=(180, 0), times=50)
        np.testing.assert_allclose(sample.position, here, atol=1e-9)


def test_letting_go_loses_what_the_hand_had_still_to_go() -> None:
    desk = Desk(POINTER)
    desk.hold()
    moving = desk.tell(press="hold", pointer=(50, 0))
    assert moving.velocity[1] < 0
    still = desk.tell(pointer=(50, 0), times=20)
    np.testing.assert_array_equal(still.position, moving.position)
    again = desk.tell(press="hold", pointer=(50, 0), times=20)
    np.testing.assert_array_equal(again.position, moving.position)


def test_a_pointer_that_jumps_moves_nothing() -> None:
    desk = Desk(POINTER)
    desk.hold()
    here = desk.tell(press="hold", pointer=(10, 0), times=300).position
    sample = desk.tell(press="hold", pointer=(5000.0, 0.0), times=50)
    np.testing.assert_allclose(sample.position, here, atol=1e-9)
    assert sample.dead_man


@pytest.mark.parametrize("elsewhere", [(float("nan"), 0.0), (1e308, 0.0), (0.0, -1e308), None])
def test_a_pointer_that_is_nowhere_stops_the_hand_until_it_is_pressed_anew(
    elsewhere: tuple[float, float] | None,
) -> None:
    desk = Desk(POINTER)
    desk.hold()
    here = desk.tell(press="hold", pointer=(10, 0), times=300).position
    assert not desk.tell(press="hold", pointer=elsewhere, times=50).dead_man
    assert "for the place of its pointer" in desk.source.trouble
    sample = desk.tell(press="hold", pointer=(10, 0), times=50)
    assert not sample.dead_man
    np.testing.assert_allclose(sample.position, here, atol=1e-9)
    desk.hold()
    assert desk.tell(press="hold").dead_man


# --- gone and back --------------------------------------------------------------------------------


@pytest.mark.parametrize("gone", [None, UnpluggedError("stick is gone: connect it")])
def test_a_device_that_is_gone_stops_at_once_says_so_and_needs_a_released_dead_man(
    gone: UnpluggedError | None,
) -> None:
    desk = Desk()
    assert isinstance(desk.source, Troubled)
    desk.hold()
    here = desk.tell(1.0, press="hold", times=5).position
    desk.device.says = gone
    still = desk.ask()
    assert not still.dead_man
    np.testing.assert_array_equal(still.velocity, np.zeros(3))
    np.testing.assert_array_equal(still.position, here)
    assert "stick is gone" in desk.source.trouble
    assert desk.ask(100) is not None
    back = desk.tell(1.0, press="hold", times=20)
    assert not back.dead_man
    np.testing.assert_array_equal(back.position, here)
    assert "has not been at rest since it came" in desk.source.trouble
    assert not desk.tell(press="hold", times=20).dead_man
    assert "let go of it and press it anew" in desk.source.trouble
    desk.hold()
    assert desk.source.trouble == ""
    assert desk.tell(1.0, press="hold").velocity[0] > 0
    desk.source.close()
    assert desk.device.closed


def test_it_rests_until_it_is_told_to_play_and_then_until_the_dead_man_was_released() -> None:
    desk = Desk()
    desk.hold()
    desk.device.says = DeviceReading((1.0,) * 6, frozenset({"hold"}))
    waiting = desk.source.sample(None)
    assert not waiting.dead_man
    np.testing.assert_array_equal(waiting.velocity, np.zeros(3))
    assert not desk.ask(5).dead_man
    assert "let go of it" in desk.source.trouble
    desk.hold()
    assert desk.ask().dead_man


def test_the_service_goes_on_publishing_rest_and_is_unhealthy_while_the_device_is_gone(
    make_desk: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    device = Fake()
    source = DeviceSource(device, rules_of(DeviceSettings(), STICK))
    monkeypatch.setattr(service_module, "BUILT_IN", {"stick": lambda *_: source})
    desk = make_desk(source="stick", dead_zone_m=0.01)
    desk.until(lambda: desk.service.health() == (True, "playing"), "the start")
    device.says = DeviceReading((1.0,) + (0.0,) * 5, frozenset({"hold"}))
    desk.until(lambda: desk.steps, "a step")
    device.says = None
    desk.until(lambda: not desk.motions[-1].body.dead_man, "the stop")
    count = len(desk.motions)
    desk.until(lambda: len(desk.motions) > count + 5, "samples at rest")
    assert not any(motion.body.velocity.any() for motion in desk.motions[count:])
    healthy, detail = desk.service.health()
    assert not healthy
    assert "stick is gone: plug it in again" in detail


# --- what holds whatever a device says ------------------------------------------------------------

_ANY = st.floats(allow_nan=True, allow_infinity=True) | st.floats(-1.5, 1.5)
_READING = st.builds(
    DeviceReading,
    st.tuples(*[_ANY] * 6),
    st.frozensets(st.sampled_from(["hold", "slip", "mark", "other"]))
    | st.just(frozenset({"hold"})),
    st.none() | st.tuples(_ANY, _ANY) | st.tuples(st.integers(-50, 50), st.integers(-50, 50)),
)


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


# --- settings -------------------------------------------------------------------------------------


def test_an_axis_the_device_does_not_have_is_named_with_the_choices() -> None:
    with pytest.raises(UserError, match=r"device\.axes\.z: .* no axis 'rz': choose of x, y,"):
        rules_of(DeviceSettings(axes={"z": "-rz"}), POINTER)


def test_a_button_of_two_meanings_is_refused() -> None:
    with pytest.raises(UserError, match=r"device\.buttons: .* not three different buttons"):
        rules_of(DeviceSettings(buttons={"pedal": "hold"}), STICK)


# --- libraries and what is there ------------------------------------------------------------------

LIBRARIES = ("pygame", "pyspacemouse", "pynput")


@pytest.fixture
def nothing_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [*sys.modules, *LIBRARIES]:
        if name.partition(".")[0] in LIBRARIES:
            monkeypatch.setitem(sys.modules, name, None)


@pytest.mark.usefixtures("nothing_installed")
@pytest.mark.parametrize("name", [kind.name for kind in KINDS])
def test_a_library_that_is_missing_is_named_with_its_extra(name: str) -> None:
    with pytest.raises(UserError, match=rf"not installed: install hmcs-input-device\[{name}\]"):
        open_source(InputDeviceSettings(source=name), TASK, BUILT_IN)


@pytest.mark.usefixtures("nothing_installed")
def test_every_device_is_found_to_be_missing_with_what_to_install() -> None:
    sightings = found()
    assert [s.name for s in sightings] == ["gamepad", "spacemouse", "keyboard", "mouse"]
    assert {s.state for s in sightings} == {"not installed"}
    for sighting in sightings:
        assert f"[{sighting.name}]" in sighting.remedy


def fake_library(monkeypatch: pytest.MonkeyPatch, name: str, **contents: Any) -> ModuleType:
    module = ModuleType(name)
    module.__dict__.update(contents)
    monkeypatch.setitem(sys.modules, name, module)
    return module


def on_a_clock(source: Any) -> Any:
    """Let the time of a source go on by a hundredth of a second with every sample."""
    ticks = count()
    source._clock = lambda: PERIOD_S * next(ticks)
    return source


class FakeSpaceMouse:
    """What pyspacemouse opens: one report a reading, many waiting."""

    info = SimpleNamespace(button_names=("LEFT", "RIGHT"))

    def __init__(self) -> None:
        self.waiting: list[float] = []
        self.state = SimpleNamespace(
            t=0.0, x=0.0, y=0.0, z=0.0, roll=0.0, pitch=0.0, yaw=0.0, buttons=[0, 0]
        )
        self.broken = False

    def read(self) -> SimpleNamespace:
        if self.broken:
            raise OSError("no such device")
        if self.waiting:
            self.state.t, self.state.x = self.state.t + 1, self.waiting.pop(0)
        return self.state

    def close(self) -> None:
        self.state.x = 0.0


def test_a_spacemouse_is_read_to_its_newest_report_lost_and_taken_up_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    there, opened = ["SpaceNavigator", "SpaceMouseCompact", "SpaceMouseCompact"], []

    def open_one(device: str, axis_convention: str) -> FakeSpaceMouse:
        assert axis_convention == "ros"
        assert device == "SpaceMouseCompact"
        opened.append(FakeSpaceMouse())
        return opened[-1]

    fake_library(
        monkeypatch,
        "pyspacemouse",
        get_connected_devices=lambda: there,
        open=open_one,
        AxisConvention=SimpleNamespace(ROS="ros"),
    )
    assert found()[1][:3] == ("spacemouse", "ready", "SpaceNavigator, SpaceMouseCompact")
    source = on_a_clock(
        open_source(
            InputDeviceSettings(source="spacemouse", device={"which": "compact"}), TASK, BUILT_IN
        )
    )
    source.sample(0.0)
    opened[0].state.buttons = [1, 0]
    source.sample(0.01)
    opened[0].waiting = [0.1, 0.5, 1.0]
    sample = source.sample(0.02)
    np.testing.assert_allclose(sample.velocity, [DeviceSettings().scale_m_s, 0, 0])
    silent = [source.sample(0.02) for _ in range(round(2 * SILENT_S / PERIOD_S))]
    assert PERIOD_S * sum(sample.dead_man for sample in silent) <= SILENT_S
    assert "spacemouse is silent" in source.trouble
    opened[0].broken = True
    there.clear()
    for elapsed_s in (0.03, 0.04):
        sample = source.sample(elapsed_s)
        assert not sample.dead_man
        assert "spacemouse" in source.trouble
    there.append("SpaceMouseCompact")
    source.sample(0.05)
    opened[1].state.buttons = [1, 0]
    assert source.sample(0.06).dead_man
    assert source.trouble == ""
    there.clear()
    with pytest.raises(UserError, match=r"none named 'compact' is there \(there: none\)"):
        open_source(
            InputDeviceSettings(source="spacemouse", device={"which": "compact"}), TASK, BUILT_IN
        )


def test_a_spacemouse_without_hidapi_or_without_the_right_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fails(*_: Any, **__: Any) -> None:
        raise RuntimeError("Failed to open device")

    module = fake_library(
        monkeypatch,
        "pyspacemouse",
        get_connected_devices=lambda: ["Navigator"],
        open=fails,
        AxisConvention=SimpleNamespace(ROS="ros"),
    )
    with pytest.raises(UserError, match="udev rule"):
        open_source(InputDeviceSettings(source="spacemouse"), TASK, BUILT_IN)
    monkeypatch.setattr(module, "get_connected_devices", fails)
    sighting = found()[1]
    assert sighting.state == "not installed"
    assert "libhidapi" in sighting.remedy


def test_a_button_the_device_does_not_have_is_named_with_those_it_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fake_library(
        monkeypatch,
        "pyspacemouse",
        get_connected_devices=lambda: ["SpaceMousePro"],
        open=lambda **_: FakeSpaceMouse(),
        AxisConvention=SimpleNamespace(ROS="ros"),
    )
    # Nobody asked for the usual pedal, which one of two buttons cannot have.
    open_source(InputDeviceSettings(source="spacemouse"), TASK, BUILT_IN)
    for use in ("dead_man", "pedal"):
        with pytest.raises(UserError, match=rf"{use}: .* no button 'fit': choose of left, right"):
            open_source(
                InputDeviceSettings(source="spacemouse", device={"buttons": {use: "fit"}}),
                TASK,
                BUILT_IN,
            )


class FakePad:
    """What SDL calls a controller."""

    def __init__(self) -> None:
        self.there, self.axes, self.pressed = True, [0] * 6, set[int]()

    def attached(self) -> bool:
        return self.there

    def get_axis(self, number: int) -> int:
        return self.axes[number]

    def get_button(self, number: int) -> bool:
        return number in self.pressed


def fake_sdl(monkeypatch: pytest.MonkeyPatch, pads: list[FakePad]) -> None:
    def nothing(*_: Any) -> None:
        return None

    part = SimpleNamespace(init=nothing, get_count=lambda: len(pads), clear=nothing)
    controllers = ModuleType("pygame._sdl2.controller")
    controllers.__dict__.update(
        init=nothing,
        quit=nothing,
        is_controller=lambda _: True,
        name_forindex=lambda number: f"Pad {number}",
        Controller=lambda number: pads[number],
    )
    fake_library(monkeypatch, "pygame", display=part, joystick=part, event=part, quit=nothing)
    monkeypatch.setitem(sys.modules, "pygame._sdl2", ModuleType("pygame._sdl2"))
    monkeypatch.setitem(sys.modules, "pygame._sdl2.controller", controllers)


def test_a_gamepads_stick_moves_the_hand_over_the_table_and_it_is_taken_up_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pads = [FakePad()]
    fake_sdl(monkeypatch, pads)
    assert found()[0][:3] == ("gamepad", "ready", "Pad 0")
    source = on_a_clock(open_source(InputDeviceSettings(source="gamepad"), TASK, BUILT_IN))
    full = DeviceSettings().scale_m_s
    source.sample(0.0)
    pads[0].pressed = {10}
    source.sample(0.01)
    pads[0].axes = [0, -32768, 0, 0, 0, 0]
    np.testing.assert_allclose(source.sample(0.02).velocity, [full, 0, 0], atol=1e-12)
    pads[0].axes = [32767, 0, 0, 0, 0, 0]
    np.testing.assert_allclose(source.sample(0.03).velocity, [0, -full, 0], atol=1e-12)
    pads[0].there = False
    pads[0] = FakePad()
    pads[0].pressed = {10}
    assert not source.sample(0.04).dead_man
    assert "gamepad is gone" in source.trouble
    assert not source.sample(0.05).dead_man
    pads[0].pressed = set()
    source.sample(0.06)
    pads[0].pressed = {10}
    assert source.sample(0.07).dead_man
    source.close()


def test_no_gamepad_is_a_users_mistake_that_lists_what_is_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pads = [FakePad()]
    fake_sdl(monkeypatch, pads)
    with pytest.raises(UserError, match=r"no gamepad named 'Other' is there \(there: Pad 0\)"):
        open_source(
            InputDeviceSettings(source="gamepad", device={"which": "Other"}), TASK, BUILT_IN
        )
    pads.clear()
    with pytest.raises(UserError, match=r"none is there that SDL knows \(there: none\)"):
        open_source(InputDeviceSettings(source="gamepad"), TASK, BUILT_IN)
    assert found()[0].state == "no device"


class Listener:
    """What pynput hears with."""

    def __init__(self, **handlers: Callable[..., None]) -> None:
        self.__dict__.update(handlers)
        self.alive = False

    def start(self) -> None:
        self.alive = True

    def stop(self) -> None:
        self.alive = False

    def is_alive(self) -> bool:
        return self.alive


def test_keys_that_are_held_are_axes_and_buttons_until_nobody_listens() -> None:
    keyboard = Keyboard(SimpleNamespace(Listener=Listener))
    listener: Any = keyboard._listener
    keys = [SimpleNamespace(name=n) for n in ("up", "left", "page_down", "ctrl_r", "shift_l")]
    for key in [*keys, SimpleNamespace(char="W"), SimpleNamespace(char=None)]:
        listener.on_press(key)
    reading = keyboard.read()
    assert reading.axes == (-1.0, 1.0, -1.0, 0.0, 0.0, 0.0)
    assert reading.buttons >= {"ctrl_r", "shift", "w"}
    for key in [*keys, SimpleNamespace(char="w")]:
        listener.on_release(key)
    assert keyboard.read()[:2] == ((0.0,) * 6, frozenset())
    assert keyboard.read().report == keyboard.read().report
    before = keyboard.read().report
    listener.on_press(keys[0])
    repeated = keyboard.read().report
    listener.on_press(keys[0])
    assert len({before, repeated, keyboard.read().report}) == 3
    keyboard.close()
    with pytest.raises(UnpluggedError, match="keyboard is gone"):
        keyboard.read()


def test_a_mouse_tells_its_pointer_upward_and_the_buttons_that_are_held() -> None:
    mouse = Mouse(
        SimpleNamespace(Listener=Listener, Controller=lambda: SimpleNamespace(position=(3, 4)))
    )
    listener: Any = mouse._listener
    assert mouse.read().pointer == (3.0, -4.0)
    listener.on_move(10, 2, False)
    listener.on_click(10, 3, SimpleNamespace(name="left"), True, False)
    assert mouse.read()[1:3] == (frozenset({"left"}), (10.0, -3.0))
    before = mouse.read().report
    listener.on_move(10, 3, False)
    assert mouse.read().report != before
    listener.on_click(10, 3, SimpleNamespace(name="left"), False, False)
    assert mouse.read().buttons == frozenset()


@pytest.mark.parametrize("name", ["keyboard", "mouse"])
def test_a_session_where_a_release_may_not_be_seen_is_refused(
    monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    fake_library(monkeypatch, "pynput")
    fake_library(monkeypatch, "pynput.keyboard")
    fake_library(monkeypatch, "pynput.mouse")
    monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-0")
    with pytest.raises(UserError, match=r"Wayland session.*log in to an X11 session"):
        open_source(InputDeviceSettings(source=name), TASK, BUILT_IN)
    assert {s.name: s.state for s in found()}[name] == "no device"
    monkeypatch.delenv("WAYLAND_DISPLAY")
    monkeypatch.setenv("DISPLAY", ":7")
    assert {s.name: s.detail for s in found()}[name] == "session :7"
