"""Where the operator's motion comes from: one small interface, and the hook for real devices.

A source is asked for a sample at every tick. To add a device, write a distribution with a function
that makes a `Source` of the settings and the task, and name it in its `pyproject.toml`:

    [project.entry-points."hmcs.input_sources"]
    my_haptic_arm = "my_package.device:open_device"

Once it is installed beside the input device, `--source my_haptic_arm` chooses it; what it needs to
know goes into the setting `options`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from importlib.metadata import EntryPoint, entry_points
from typing import Protocol, runtime_checkable

import numpy as np

from hmcs.arrays import Array
from hmcs.bus.messages import Handle
from hmcs.errors import UserError
from hmcs.motion.device_sample import FARTHEST_M, FASTEST_M_S, LIVE, DeviceSample
from hmcs.task import Task
from hmcs.task.values import unknown_name_message
from hmcs_input_device.settings import InputDeviceSettings

__all__ = [
    "FARTHEST_M",
    "FASTEST_M_S",
    "LIVE",
    "DeviceSample",
    "HearsHandle",
    "Plays",
    "SeesRobot",
    "Source",
    "SourceFactory",
    "Troubled",
    "at_rest",
    "check_source",
    "open_source",
    "plays",
    "released",
]

ENTRY_POINTS = "hmcs.input_sources"
"""Group of the entry points that name sources."""


def released(sample: DeviceSample) -> DeviceSample:
    """Return a sample of the same hand, still, with the dead-man up."""
    turning = None if sample.angular_velocity is None else np.zeros(3)
    return sample._replace(velocity=np.zeros(3), angular_velocity=turning, dead_man=False)


def at_rest(sample: DeviceSample) -> DeviceSample:
    """Return a sample of the same hand at rest, that touches nothing."""
    wrench = None if sample.wrench is None else np.zeros(6)
    return released(sample)._replace(clutch=False, pedal=False, wrench=wrench)


class Source(Protocol):
    """A device, or something that plays one.

    It passes on what it sees of the device and judges nothing: whether a press of the dead-man
    counts, and what becomes of nonsense, is decided in one place for all (`guarded`).
    """

    @property
    def rate_hz(self) -> float:
        """How often it wants to be asked."""

    @property
    def duration_s(self) -> float:
        """How long it plays; LIVE for a device that is moved by a hand here and now."""

    @property
    def reach_m(self) -> float | None:
        """How far its motion goes from where it begins; None where nobody can know."""

    def sample(self, elapsed_s: float | None) -> DeviceSample | None:
        """Return the device as it is now; None where it has nothing to say: the hand then rests.

        `elapsed_s` counts from the request to play; None before. It must not wait.
        """

    def close(self) -> None:
        """Let go of the device."""


@runtime_checkable
class SeesRobot(Protocol):
    """A source whose operator looks at the robot."""

    def sees(self, position: Array, orientation: Array) -> None:
        """Take in the robot's tool, base frame: position, m, (3,), and how it is turned, (4,)."""


@runtime_checkable
class HearsHandle(Protocol):
    """A source that is the handle of a page."""

    def handled(self, now_s: float, handle: Handle) -> bool:
        """Take in what a page says; False where it is refused, see `refusal`."""

    @property
    def refusal(self) -> str:
        """Why the last one was refused."""

    def seconds(self, now_s: float) -> None:
        """Set the time of the next sample, by the clock of `handled`."""


@runtime_checkable
class Plays(Protocol):
    """A source that says whether it plays: whether nobody's hand moves it."""

    @property
    def plays(self) -> bool:
        """True where nobody presses the dead-man: a stop that was asked for is not undone by it."""


@runtime_checkable
class Troubled(Protocol):
    """A source that may be there, at rest, and yet of no use."""

    @property
    def trouble(self) -> str:
        """Why nothing moves, and what to do; empty while all is well."""


def plays(source: Source) -> bool:
    """Return whether nobody's hand moves a source."""
    return isinstance(source, Plays) and source.plays


SourceFactory = Callable[[InputDeviceSettings, Task], Source]
"""Makes a source; raises UserError where the settings do not let it."""


def check_source(name: str, built_in: Collection[str]) -> None:
    """Raise UserError for a source that is neither built in nor of another distribution."""
    known = {*built_in, *_others()}
    if name not in known:
        raise UserError(
            f"source: {unknown_name_message('input source', name, known)}; a distribution adds one "
            f"with an entry point in the group {ENTRY_POINTS}"
        )


def _others() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=ENTRY_POINTS)}


def open_source(
    settings: InputDeviceSettings, task: Task, built_in: Mapping[str, SourceFactory]
) -> Source:
    """Return the source that the settings name, built in or of another distribution.

    Raises UserError where there is none of that name, it cannot be loaded, or refuses its settings.
    """
    check_source(settings.source, built_in)
    if settings.source in built_in:
        return built_in[settings.source](settings, task)
    others = _others()
    try:
        factory: SourceFactory = others[settings.source].load()
    except (ImportError, AttributeError) as error:
        raise UserError(
            f"source: {settings.source} = {others[settings.source].value!r} cannot be loaded: "
            f"{error}: mend or remove the distribution that adds it"
        ) from error
    return factory(settings, task)
