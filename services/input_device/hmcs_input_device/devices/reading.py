"""What every device says, whatever it is."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

AXES = ("x", "y", "z", "rx", "ry", "rz")
"""Names of a device's axes, in the order of a reading."""


class UnpluggedError(Exception):
    """The device is gone; its message says which and what to do."""


class DeviceReading(NamedTuple):
    """A device at one moment."""

    axes: tuple[float, ...]
    """Deflection of each of AXES, a share of the full one: -1 to 1; 0 where it has no such axis."""
    buttons: frozenset[str] = frozenset()
    """Names of those that are pressed."""
    pointer: tuple[float, float] | None = None
    """px, to the right and up, from anywhere; None where it has none."""
    report: float | None = None
    """Another one with every report of the device; None where its library does not tell: then only
    what changes shows that it lives."""


class Device(Protocol):
    """A device that is asked how it is."""

    @property
    def name(self) -> str:
        """What a person calls it."""

    def read(self) -> DeviceReading | None:
        """Return how it is now, without waiting; None or UnpluggedError where it is gone.

        Asked again, a device that was plugged in again answers.
        """

    def close(self) -> None:
        """Let go of it."""


@runtime_checkable
class Buttoned(Protocol):
    """A device that knows the names of all its buttons."""

    @property
    def buttons(self) -> tuple[str, ...]:
        """Names of the buttons it has."""
