"""A gamepad, read by pygame (SDL) without a window.

Axes: the left stick to the right (x) and up (y), the right trigger less the left one (z), the right
stick to the right (rx) and up (ry). Buttons as SDL names those of every known gamepad.

SDL tells when a gamepad is detached, and of a wireless one that is out of reach only once its
receiver has given it up, after seconds. Until then its last values stand. As a gamepad reports what
changes and no more, a stick that is held still looks alike: it may be still for a second.
"""

from __future__ import annotations

import os
from typing import Any

from hmcs_input_device.devices.libraries import NoDeviceError, library
from hmcs_input_device.devices.mapping import AxisMap, Buttons, Silence, Usual
from hmcs_input_device.devices.reading import DeviceReading, UnpluggedError
from hmcs_input_device.settings import DeviceSettings

NAME = "gamepad"
BUTTONS = (
    *("a", "b", "x", "y", "back", "guide", "start", "left_stick", "right_stick"),
    *("left_shoulder", "right_shoulder", "up", "down", "left", "right"),
)
"""In the order of SDL's numbers."""
USUAL = Usual(
    "rate",
    AxisMap(x="y", y="-x", z="ry"),
    Buttons(dead_man="right_shoulder", clutch="left_shoulder", pedal="a"),
    has=("x", "y", "z", "rx", "ry"),
    silence=Silence(deflected_s=1.0),
)
"""The left stick moves the hand over the table, the right one up and down."""

_FULL = 32767.0
_LEFT_X, _LEFT_Y, _RIGHT_X, _RIGHT_Y, _LEFT_TRIGGER, _RIGHT_TRIGGER = range(6)
_ENVIRONMENT = {
    "SDL_VIDEODRIVER": "dummy",
    "SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS": "1",
    "SDL_NO_SIGNAL_HANDLERS": "1",
    "PYGAME_HIDE_SUPPORT_PROMPT": "1",
}
"""Without a window none has the focus, and the signals are the service's own."""


class Gamepad:
    """One gamepad; after it was gone, the next of that name."""

    name = NAME
    buttons = BUTTONS

    def __init__(self, pygame: Any, controllers: Any, which: str) -> None:
        """Read the first whose name holds `which`; raises NoDeviceError where there is none."""
        self._pygame, self._controllers, self._which = pygame, controllers, which
        self._pad = self._first()
        if self._pad is None:
            there = ", ".join(_names(pygame, controllers)) or "none"
            self.close()
            raise NoDeviceError(
                f"gamepad: no gamepad named {which!r} is there (there: {there})"
                if which
                else f"gamepad: none is there that SDL knows (there: {there})",
                "connect one, see `hmcs devices`",
            )

    def read(self) -> DeviceReading:
        """Return how it is now; raises UnpluggedError while it is gone."""
        self._pygame.event.clear()
        if self._pad is None or not self._pad.attached():
            # Reported once even where the next one is there already: its dead-man is another.
            was, self._pad = self._pad, self._first()
            if was is not None or self._pad is None:
                raise UnpluggedError(
                    "gamepad is gone: connect it again, then let go of the dead-man and press it "
                    "anew"
                )
        pad = self._pad
        axis = [pad.get_axis(number) / _FULL for number in range(6)]
        return DeviceReading(
            (
                axis[_LEFT_X],
                -axis[_LEFT_Y],
                axis[_RIGHT_TRIGGER] - axis[_LEFT_TRIGGER],
                axis[_RIGHT_X],
                -axis[_RIGHT_Y],
                0.0,
            ),
            frozenset(name for number, name in enumerate(BUTTONS) if pad.get_button(number)),
        )

    def close(self) -> None:
        """Let go of it and of SDL."""
        self._pad = None
        self._controllers.quit()
        self._pygame.quit()

    def _first(self) -> Any:
        for number in _known(self._pygame, self._controllers):
            if self._which.lower() in self._controllers.name_forindex(number).lower():
                return self._controllers.Controller(number)
        return None


def open_gamepad(settings: DeviceSettings) -> Gamepad:
    """Return the gamepad of the settings.

    Raises NotInstalledError without pygame, NoDeviceError where there is none.
    """
    return Gamepad(*_sdl(), settings.which)


def gamepads() -> list[str]:
    """Return the names of those that are connected; raises NotInstalledError without pygame."""
    pygame, controllers = _sdl()
    try:
        return [controllers.name_forindex(n) for n in _known(pygame, controllers)]
    finally:
        controllers.quit()
        pygame.quit()


def _sdl() -> tuple[Any, Any]:
    for name, value in _ENVIRONMENT.items():
        os.environ.setdefault(name, value)
    pygame, controllers = library("pygame", NAME), library("pygame._sdl2.controller", NAME)
    pygame.display.init()
    pygame.joystick.init()
    controllers.init()
    pygame.event.clear()
    return pygame, controllers


def _known(pygame: Any, controllers: Any) -> list[int]:
    return [n for n in range(pygame.joystick.get_count()) if controllers.is_controller(n)]


def _names(pygame: Any, controllers: Any) -> list[str]:
    known = _known(pygame, controllers)
    return [
        controllers.name_forindex(n) if n in known else f"a joystick of unknown layout, number {n}"
        for n in range(pygame.joystick.get_count())
    ]
