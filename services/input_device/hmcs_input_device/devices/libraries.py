"""Libraries of devices, which come with an extra each: loaded when a device is asked for."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from hmcs.errors import UserError


class UnusableError(UserError):
    """A device that cannot be used here and now."""

    def __init__(self, problem: str, remedy: str) -> None:
        super().__init__(f"{problem}: {remedy}")
        self.problem = problem
        self.remedy = remedy


class NotInstalledError(UnusableError):
    """A device whose software is not on this machine."""


class NoDeviceError(UnusableError):
    """A device that is not connected, or that this session cannot reach."""


def library(module: str, device: str) -> Any:
    """Return the module that reads a device.

    Raises NotInstalledError where it is missing, NoDeviceError where it finds nothing to read from.
    """
    name = module.partition(".")[0]
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise NotInstalledError(
            f"{device}: its library {name} is not installed",
            f"install hmcs-input-device[{device}], in a checkout with "
            f"`uv pip install -e 'services/input_device[{device}]'`",
        ) from error
    except ImportError as error:
        raise NoDeviceError(
            f"{device}: {name} finds no graphical session to read from",
            "start it in one (with DISPLAY set, on Linux), or use `--source page`",
        ) from error
