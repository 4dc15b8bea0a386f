"""Every kind of device that can be read, and the source that each is."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from hmcs.errors import UserError
from hmcs.task import Task
from hmcs_input_device.devices import gamepad, keyboard, mouse, spacemouse
from hmcs_input_device.devices.desktop import sessions
from hmcs_input_device.devices.device_source import DeviceSource
from hmcs_input_device.devices.mapping import Usual, check_buttons, rules_of
from hmcs_input_device.devices.reading import Buttoned, Device
from hmcs_input_device.settings import DeviceSettings, InputDeviceSettings


class Kind(NamedTuple):
    """A kind of device."""

    name: str
    """Of the source, and of the extra that brings its library."""
    usual: Usual
    open: Callable[[DeviceSettings], Device]
    """Raises UnusableError where it cannot be used here."""
    there: Callable[[], list[str]]
    """Names of those that are there; raises UnusableError where nobody can know."""


KINDS = (
    Kind(gamepad.NAME, gamepad.USUAL, gamepad.open_gamepad, gamepad.gamepads),
    Kind(spacemouse.NAME, spacemouse.USUAL, spacemouse.open_spacemouse, spacemouse.spacemice),
    Kind(keyboard.NAME, keyboard.USUAL, keyboard.open_keyboard, partial(sessions, keyboard.NAME)),
    Kind(mouse.NAME, mouse.USUAL, mouse.open_mouse, partial(sessions, mouse.NAME)),
)
"""All of them."""


def source_of(kind: Kind, settings: InputDeviceSettings, task: Task) -> DeviceSource:
    """Return a source that reads a device of this kind.

    Raises UserError where its library or the device is missing, or the settings do not fit it.
    """
    del task
    rules = rules_of(settings.device, kind.usual)
    device = kind.open(settings.device)
    if isinstance(device, Buttoned):
        try:
            check_buttons(settings.device, rules, device.buttons)
        except UserError:
            device.close()
            raise
    return DeviceSource(device, rules)
