"""The mouse of this machine's graphical session, read by pynput: its way is the hand's.

Its pointer moves right (x) and up (y) in a plane, by default the upright one before the operator.
Windows see the buttons too: keep the pointer over an empty part of the desktop. At the edge of the
screen the pointer stands, and so does the hand: bring it back with the clutch.

A mouse that is silent lets the hand rest, as one that lies still does: with its dead-man held it
counts as lost after a while only.
"""

from __future__ import annotations

import threading
from typing import Any

from hmcs_input_device.devices.desktop import check_listens, of_session
from hmcs_input_device.devices.mapping import AxisMap, Buttons, Usual
from hmcs_input_device.devices.reading import AXES, DeviceReading
from hmcs_input_device.settings import DeviceSettings

NAME = "mouse"
USUAL = Usual(
    "position",
    AxisMap(x="none", y="-x", z="y"),
    Buttons(dead_man="left", clutch="right", pedal="middle"),
    has=("x", "y"),
)
"""For the plane of a table: x of the hand is y, z is none."""


class Mouse:
    """Pointer and buttons, as a listener of its own thread hears them."""

    name = NAME

    def __init__(self, mouse: Any) -> None:
        """Listen by pynput's module `mouse`."""
        self._lock = threading.Lock()
        self._pressed: set[str] = set()
        self._reports = 0
        x, y = mouse.Controller().position
        self._pointer = float(x), -float(y)
        self._listener = mouse.Listener(on_move=self._on_move, on_click=self._on_click)
        self._listener.start()

    def read(self) -> DeviceReading:
        """Return where the pointer is; raises UnpluggedError once nobody listens."""
        check_listens(self._listener, NAME)
        with self._lock:
            return DeviceReading(
                (0.0,) * len(AXES), frozenset(self._pressed), self._pointer, self._reports
            )

    def close(self) -> None:
        """Listen no longer."""
        self._listener.stop()

    def _on_move(self, x: float, y: float, *_: Any) -> None:
        with self._lock:
            self._reports += 1
            self._pointer = float(x), -float(y)

    def _on_click(self, x: float, y: float, button: Any, pressed: bool, *_: Any) -> None:
        with self._lock:
            self._reports += 1
            self._pointer = float(x), -float(y)
            (self._pressed.add if pressed else self._pressed.discard)(button.name)


def open_mouse(settings: DeviceSettings) -> Mouse:
    """Return the mouse of this session.

    Raises NotInstalledError without pynput, NoDeviceError where the session cannot be read.
    """
    del settings
    return Mouse(of_session(NAME))
