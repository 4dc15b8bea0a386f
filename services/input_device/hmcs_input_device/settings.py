"""Settings of the input device."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

from hmcs.bus.settings import ServiceSettings
from hmcs.motion.quaternions import is_unit

AxisName = Literal["x", "y", "z", "rx", "ry", "rz", "-x", "-y", "-z", "-rx", "-ry", "-rz", "none"]
"""An axis of a device, the same the other way round, or none."""


class _Part(BaseModel):
    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True
    )


class DeviceAxes(_Part):
    """Which axis of the device moves the hand along each axis of the operator frame.

    By default as is usual for the device.
    """

    x: AxisName | None = None
    """Forward."""
    y: AxisName | None = None
    """To the left."""
    z: AxisName | None = None
    """Up."""


class DeviceButtons(_Part):
    """Which button means what, by the device's own names; by default as is usual for it."""

    dead_man: str | None = Field(default=None, min_length=1)
    """Held, it lets the hand move."""
    clutch: str | None = Field(default=None, min_length=1)
    """Held, it lets the device be moved without the hand."""
    pedal: str | None = Field(default=None, min_length=1)
    """Marks where another part of the task begins."""


class DeviceSettings(_Part):
    """How a gamepad, SpaceMouse, keyboard or mouse moves the hand."""

    which: str = ""
    """A part of the name of the gamepad or SpaceMouse; the first that is there by default."""
    axes: DeviceAxes = DeviceAxes()
    """Which axis of the device moves the hand where."""
    buttons: DeviceButtons = DeviceButtons()
    """Which button means what."""
    scale_m_s: float = Field(default=0.15, gt=0.0, le=0.5)
    """Speed of the hand at full deflection, and the greatest one that a mouse gives it."""
    dead_band: float = Field(default=0.1, ge=0.0, le=0.9)
    """Share of the full deflection up to which an axis counts as let go of."""
    jump: float = Field(default=1.0, gt=0.0, le=2.0)
    """An axis that changes by more of its full deflection from one reading to the next moves
    nothing by it."""
    m_per_pixel: float = Field(default=0.0005, gt=0.0, le=0.01)
    """How far the hand goes while the pointer of a mouse goes a pixel."""
    jump_pixels: float = Field(default=200.0, gt=0.0)
    """A pointer that goes farther from one reading to the next moves nothing by it."""
    deflected_silence_s: float | None = Field(default=None, gt=0.0, le=60.0)
    """A device that says nothing for so long while it moves the hand counts as lost; by default as
    is usual for it."""
    resting_silence_s: float | None = Field(default=None, gt=0.0, le=600.0)
    """The same while its dead-man is held and its axes are at rest."""


class InputDeviceSettings(ServiceSettings):
    """Settings of the input device: where the operator's motion comes from, and when."""

    task: str = "human-shapes"
    """Name of a task that comes along, or path of a task file."""
    source: str = "synthetic"
    """`recorded`, `synthetic`, `simulated`, `recording`, `page`, a device (`gamepad`, `spacemouse`,
    `keyboard`, `mouse`), or the name of one that another distribution adds. `auto` is `recorded`
    where `demonstration` is a file that is there, else `page`."""
    dead_zone_m: float | None = Field(default=None, gt=0, le=0.2)
    """δ: the shortest motion that counts as a step; the task's by default."""
    task_frame_xyzw: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    """How the frame the device is moved in is turned in the robot's base frame, x y z w: an
    operator who stands across from the robot, or works on a slanted table, keeps their own axes.
    Not of `simulated`, who sees the robot in its base frame."""
    steps_kept: int = Field(default=4096, ge=2000, le=10_000)
    """How many steps can be asked for again."""

    rate_hz: float | None = Field(default=None, ge=30.0, le=1000.0)
    """Samples a second; by default the recording's own rate, 100 Hz for a simulated operator."""
    autoplay: bool = True
    """Play as soon as everybody in `wait_for` is there; otherwise only when asked to `play`."""
    wait_for: tuple[str, ...] = ()
    """Services that must be present before it plays; one named twice must be there twice."""
    lead_in_s: float = Field(default=1.0, ge=0.1)
    """How long the hand rests with the dead-man released before each pass; long enough to be
    seen."""
    repeat: int = Field(default=1, ge=0)
    """How many passes; 0 for ever."""
    exit_when_played: bool = False
    """End the process, with exit code 0, once all passes are played and the dead-man has been
    released for a moment."""
    speed: float = Field(default=1.0, gt=0.0, le=100.0)
    """How many times as fast as recorded."""
    velocity_window_s: float = Field(default=0.02, gt=0.0, le=1.0)
    """Velocities are differences over so much time before and after."""
    mark_switches: bool = False
    """The pedal goes down for a moment wherever another label of the motion begins, as a
    recognizer with given restart needs it. Of `recorded` and `synthetic` only."""
    re_engage: bool = False
    """The operator of a recording who sees the robot stand lets go of the dead-man, waits, and
    presses again; the recording waits meanwhile. Of `recorded` and `synthetic` only."""
    reaction_s: float = Field(default=0.2, ge=0.0, le=10.0)
    """How long that operator sees the robot stand before letting go; the delay of eye and hand."""

    demonstration: Path | None = None
    """CSV file: what `recorded` plays, and what the operator of `synthetic` or `simulated` means
    to do. With `auto` it may be a folder: the file in it that is named as the task."""
    model: Path | None = None
    """Model file whose learned paths the operator of `synthetic` or `simulated` means to follow."""
    operator: Literal["steady", "novice", "tremor", "hurried"] = "steady"
    """Who it is that sees and steers the robot as `simulated`."""
    seed: int = Field(default=0, ge=0)
    """Of the simulated operator."""
    segments: int = Field(default=10, ge=1, le=10_000)
    """How many gestemes the simulated operator performs at most."""
    noise: float = Field(default=0.05, ge=0.0, le=0.7)
    """κ of (3.3)."""
    step_m: float = Field(default=0.01, gt=0.0)
    """Mean step of the simulated operator."""
    look_ahead_m: float = Field(default=0.03, gt=0.0)
    """How far ahead the simulated operator aims."""
    operator_speed_m_s: float = Field(default=0.1, gt=0.0)
    """Of the simulated hand."""
    primitives: Literal["line", "circle", "mixed"] = "mixed"
    """What gestemes are made of where neither demonstration nor model says it."""
    primitive_scale: float = Field(default=0.2, gt=0.0)
    """Size of those: 1 makes lines 0.5 to 1.5 m long, as in the thesis' study."""

    device: DeviceSettings = DeviceSettings()
    """How a gamepad, SpaceMouse, keyboard or mouse moves the hand."""
    options: dict[str, Any] = Field(default_factory=dict)
    """Settings of a device of another distribution."""

    @field_validator("task_frame_xyzw")
    @classmethod
    def _is_a_rotation(
        cls, value: tuple[float, float, float, float]
    ) -> tuple[float, float, float, float]:
        if not is_unit(value):
            raise ValueError(f"{list(value)} is no unit quaternion x y z w")
        return value
