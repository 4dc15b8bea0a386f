"""A SpaceMouse, read by pyspacemouse over HID.

Axes: x forward, y left, z up, and the turns about them, as in the operator frame. Buttons as
pyspacemouse names them, in lower case.

While its cap is deflected it sends some 400 reports a second, and pyspacemouse tells the time of
the newest: without a new one it is out of reach. At rest it sends nothing.
"""

from __future__ import annotations

from typing import Any

from hmcs_input_device.devices.libraries import NoDeviceError, NotInstalledError, library
from hmcs_input_device.devices.mapping import AxisMap, Buttons, Silence, Usual
from hmcs_input_device.devices.reading import DeviceReading, UnpluggedError
from hmcs_input_device.press_gate import SILENT_S
from hmcs_input_device.settings import DeviceSettings

NAME = "spacemouse"
USUAL = Usual(
    "rate",
    AxisMap(x="x", y="y", z="z"),
    Buttons(dead_man="left", clutch="right", pedal="menu"),
    silence=Silence(deflected_s=SILENT_S),
)
"""One with two buttons only has no pedal; one without a left button needs another dead-man."""

_MOST_REPORTS = 32
"""Read at one asking; it sends some 400 a second, each of a part of its axes."""


class SpaceMouse:
    """One SpaceMouse; after it was gone, the next of that name."""

    name = NAME

    def __init__(self, pyspacemouse: Any, which: str) -> None:
        """Read the first whose name holds `which`; raises NoDeviceError where there is none."""
        self._library, self._which = pyspacemouse, which
        self._mouse: Any = self._open()
        self.buttons = self._named()

    def read(self) -> DeviceReading:
        """Return how it is now; raises UnpluggedError while it is gone."""
        if self._mouse is None:
            try:
                self._mouse = self._open()
                self.buttons = self._named()
            except NoDeviceError as error:
                raise UnpluggedError(str(error)) from error
        try:
            state = self._newest()
        # pyspacemouse lets through whatever its HID library raises, of a type it does not export.
        except Exception as error:
            self.close()
            raise UnpluggedError(
                f"spacemouse is gone ({error}): connect it again, then let go of the dead-man and "
                "press it anew"
            ) from error
        pressed = zip(self.buttons, state.buttons, strict=False)
        return DeviceReading(
            (state.x, state.y, state.z, state.roll, state.pitch, state.yaw),
            frozenset(name for name, down in pressed if down),
            report=state.t,
        )

    def close(self) -> None:
        """Let go of it."""
        mouse, self._mouse = self._mouse, None
        if mouse is not None:
            mouse.close()

    def _named(self) -> tuple[str, ...]:
        return tuple(name.lower() for name in self._mouse.info.button_names)

    def _newest(self) -> Any:
        state = self._mouse.read()
        for _ in range(_MOST_REPORTS):
            told_s = state.t
            state = self._mouse.read()
            if state.t == told_s:
                break
        return state

    def _open(self) -> Any:
        there = _connected(self._library)
        chosen = next((name for name in there if self._which.lower() in name.lower()), None)
        if chosen is None:
            raise NoDeviceError(
                f"spacemouse: none{f' named {self._which!r}' if self._which else ''} is there "
                f"(there: {', '.join(there) or 'none'})",
                "connect one, see `hmcs devices`",
            )
        try:
            return self._library.open(
                device=chosen, axis_convention=self._library.AxisConvention.ROS
            )
        except RuntimeError as error:
            raise NoDeviceError(
                f"spacemouse: {chosen} cannot be opened ({error})",
                "let this user read its /dev/hidraw file with a udev rule, and end what else "
                "reads it",
            ) from error


def open_spacemouse(settings: DeviceSettings) -> SpaceMouse:
    """Return the SpaceMouse of the settings.

    Raises NotInstalledError without pyspacemouse or hidapi, NoDeviceError where there is none.
    """
    return SpaceMouse(library("pyspacemouse", NAME), settings.which)


def spacemice() -> list[str]:
    """Return the names of those that are connected; raises NotInstalledError as above."""
    return _connected(library("pyspacemouse", NAME))


def _connected(pyspacemouse: Any) -> list[str]:
    try:
        # One that has several HID interfaces is listed several times.
        return list(dict.fromkeys(pyspacemouse.get_connected_devices()))
    except RuntimeError as error:
        raise NotInstalledError(
            "spacemouse: the system library hidapi is not installed",
            "install it, on Debian with `apt install libhidapi-hidraw0`",
        ) from error
