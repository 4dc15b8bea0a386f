"""Which devices are there, which are missing, and what to do about it."""

from __future__ import annotations

from typing import Literal, NamedTuple

from hmcs_input_device.devices.kinds import KINDS, Kind
from hmcs_input_device.devices.libraries import NotInstalledError, UnusableError


class Sighting(NamedTuple):
    """A kind of device on this machine now."""

    name: str
    """Of the source that reads it."""
    state: Literal["ready", "no device", "not installed"]
    detail: str
    """What is there, or what is missing."""
    remedy: str
    """What to do to use it."""


def found() -> list[Sighting]:
    """Return a sighting for every kind of device, in the order of KINDS."""
    return [_look(kind) for kind in KINDS]


def _look(kind: Kind) -> Sighting:
    try:
        there = kind.there()
    except UnusableError as error:
        missing = isinstance(error, NotInstalledError)
        problem = error.problem.removeprefix(f"{kind.name}: ")
        return Sighting(
            kind.name, "not installed" if missing else "no device", problem, error.remedy
        )
    if not there:
        return Sighting(kind.name, "no device", "none is connected", "connect one")
    return Sighting(kind.name, "ready", ", ".join(there), f"use it with `--source {kind.name}`")
