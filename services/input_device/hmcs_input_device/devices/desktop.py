"""The graphical session that keyboard and mouse are read from, by pynput."""

from __future__ import annotations

import os
from typing import Any

from hmcs_input_device.devices.libraries import NoDeviceError, library
from hmcs_input_device.devices.reading import UnpluggedError


def of_session(device: str) -> Any:
    """Return pynput's module for a device, `keyboard` or `mouse`.

    Raises NotInstalledError without pynput, NoDeviceError where this session cannot be read.
    """
    module = library(f"pynput.{device}", device)
    if os.environ.get("WAYLAND_DISPLAY"):
        # There pynput sees only what goes to some windows: the release of a dead-man may not.
        raise NoDeviceError(
            f"{device}: this is a Wayland session, where the release of a key or button may not be "
            "seen",
            "log in to an X11 session, or use `--source page`",
        )
    return module


def sessions(device: str) -> list[str]:
    """Return the session where a device can be read; raises as `of_session`."""
    of_session(device)
    return [f"session {os.environ.get('DISPLAY', '')}".rstrip()]


def check_listens(listener: Any, device: str) -> None:
    """Raise UnpluggedError where nobody listens to a device any more."""
    if not listener.is_alive():
        raise UnpluggedError(
            f"{device} is gone: its graphical session has ended: start the input device again in "
            "a new one"
        )
