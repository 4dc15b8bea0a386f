"""A gamepad, through a library that is made up."""

from __future__ import annotations

import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs_input_device.devices.detect import found
from hmcs_input_device.played import BUILT_IN
from hmcs_input_device.settings import DeviceSettings, InputDeviceSettings
from hmcs_input_device.sources import open_source
from support.devices import TASK, fake_library, on_a_clock


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
