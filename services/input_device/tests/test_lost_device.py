"""A device that is silent or gone stops the hand, until it is there and pressed anew."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hmcs_input_device import service as service_module
from hmcs_input_device.devices.device_source import DeviceSource
from hmcs_input_device.devices.kinds import KINDS
from hmcs_input_device.devices.mapping import rules_of
from hmcs_input_device.devices.reading import DeviceReading, UnpluggedError
from hmcs_input_device.press_gate import SILENT_S
from hmcs_input_device.settings import DeviceSettings
from hmcs_input_device.sources import Troubled
from support.devices import PERIOD_S, STICK, Desk, FakeDevice

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


def test_it_rests_until_it_is_asked_to_play_and_then_until_the_dead_man_was_released() -> None:
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
    device = FakeDevice()
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
