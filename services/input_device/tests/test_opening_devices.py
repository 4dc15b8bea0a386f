"""A device that cannot be opened says what is wrong with its settings, library or session."""

from __future__ import annotations

import sys

import pytest

from hmcs.errors import UserError
from hmcs_input_device.devices.detect import found
from hmcs_input_device.devices.kinds import KINDS
from hmcs_input_device.devices.mapping import rules_of
from hmcs_input_device.played import BUILT_IN
from hmcs_input_device.settings import DeviceSettings, InputDeviceSettings
from hmcs_input_device.sources import open_source
from support.devices import POINTER, STICK, TASK, fake_library

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
