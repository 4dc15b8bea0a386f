"""The keyboard of this machine's graphical session, read by pynput.

Axes: the arrows to the right (x) and up (y), page up and down (z). Buttons are keys: a character,
or a name such as `shift` or `ctrl_r`. It is heard whatever window has the focus, so the dead-man is
a key that is seldom used for anything else. It must be one that does not repeat while it is held.

The session releases the keys of a keyboard that is unplugged, not of a wireless one that is out of
reach, nor those of a session that hangs. A key that moves the hand is repeated while it is held,
some time after it was pressed: without that nobody knows whether the keyboard is still there.
"""

from __future__ import annotations

import threading
from typing import Any

from hmcs_input_device.devices.desktop import check_listens, of_session
from hmcs_input_device.devices.mapping import AxisMap, Buttons, Silence, Usual
from hmcs_input_device.devices.reading import DeviceReading
from hmcs_input_device.settings import DeviceSettings

NAME = "keyboard"
USUAL = Usual(
    "rate",
    AxisMap(x="y", y="-x", z="z"),
    Buttons(dead_man="ctrl_r", clutch="ctrl", pedal="shift"),
    has=("x", "y", "z"),
    silence=Silence(deflected_s=1.5),
    switches=True,
)
"""The arrows move the hand over the table, page up and down lift and lower it."""


class Keyboard:
    """The keys that are pressed, as a listener of its own thread hears them."""

    name = NAME

    def __init__(self, keyboard: Any) -> None:
        """Listen by pynput's module `keyboard`."""
        self._lock = threading.Lock()
        self._pressed: set[str] = set()
        self._reports = 0
        self._listener = keyboard.Listener(on_press=self._on_press, on_release=self._on_release)
        self._listener.start()

    def read(self) -> DeviceReading:
        """Return the keys that are pressed; raises UnpluggedError once nobody listens."""
        check_listens(self._listener, NAME)
        with self._lock:
            keys, reports = frozenset(self._pressed), self._reports
        ways = (("right", "left"), ("up", "down"), ("page_up", "page_down"))
        axes = (float(more in keys) - float(less in keys) for more, less in ways)
        return DeviceReading((*axes, 0.0, 0.0, 0.0), keys, report=reports)

    def close(self) -> None:
        """Listen no longer."""
        self._listener.stop()

    def _on_press(self, key: Any) -> None:
        name = key_name(key)
        with self._lock:
            self._reports += 1
            if name:
                self._pressed.add(name)

    def _on_release(self, key: Any) -> None:
        with self._lock:
            self._reports += 1
            self._pressed.discard(key_name(key))


def key_name(key: Any) -> str:
    """Return the name of a key of pynput, alike on every platform; empty where it has none.

    A letter is the same key with and without shift, and `shift` is the left one.
    """
    name = getattr(key, "name", None) or getattr(key, "char", None) or ""
    return name.removesuffix("_l").lower()


def open_keyboard(settings: DeviceSettings) -> Keyboard:
    """Return the keyboard of this session.

    Raises NotInstalledError without pynput, NoDeviceError where the session cannot be read.
    """
    del settings
    return Keyboard(of_session(NAME))
