"""A SpaceMouse, through a library that is made up."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs_input_device.devices.detect import found
from hmcs_input_device.played import BUILT_IN
from hmcs_input_device.press_gate import SILENT_S
from hmcs_input_device.settings import DeviceSettings, InputDeviceSettings
from hmcs_input_device.sources import open_source
from support.devices import PERIOD_S, TASK, fake_library, on_a_clock


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
