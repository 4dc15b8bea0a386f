"""From what a device says to the motion of a hand: pure, one reading after another.

A reading moves the hand only together with the one before it: both usable, both with the dead-man
held and no clutch, and near each other. Whatever else happens, the hand rests.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.errors import UserError
from hmcs_input_device.devices.reading import AXES, DeviceReading
from hmcs_input_device.settings import AxisName, DeviceSettings

FloatArray = NDArray[np.float64]

FOLLOW_S = 0.08
"""Time constant with which the hand follows a pointer, which tells its place in jerks; also the
longest time that one reading moves the hand for: nobody knows what a device did meanwhile."""

Kind = Literal["rate", "position"]
"""A deflection is a velocity; a way of the pointer is a way of the hand."""


class AxisMap(NamedTuple):
    """Which axis of the device moves the hand along each axis of the operator frame."""

    x: AxisName
    y: AxisName
    z: AxisName

    def matrix(self) -> FloatArray:
        """Return what makes a vector of the operator frame of a device's axes, shape (3, 6)."""
        matrix = np.zeros((3, len(AXES)))
        for row, name in enumerate(self):
            if name != "none":
                matrix[row, AXES.index(name.removeprefix("-"))] = -1 if name[0] == "-" else 1
        return matrix


class Buttons(NamedTuple):
    """Names of the buttons that mean something."""

    dead_man: str
    clutch: str
    pedal: str


class Usual(NamedTuple):
    """How a kind of device is used where the settings do not say it."""

    kind: Kind
    axes: AxisMap
    buttons: Buttons
    has: tuple[str, ...] = AXES
    """Axes that it has, of AXES."""


class Rules(NamedTuple):
    """How a device moves the hand."""

    kind: Kind
    axes: FloatArray
    """Shape (3, 6), see `AxisMap.matrix`."""
    buttons: Buttons
    scale_m_s: float
    dead_band: float
    jump: float
    m_per_pixel: float
    jump_pixels: float


class Hand(NamedTuple):
    """The hand that a device moves, and what the next reading is judged by."""

    position: FloatArray = np.zeros(3)
    """m, operator frame, shape (3,): the integral of its velocities."""
    velocity: FloatArray = np.zeros(3)
    """m/s, shape (3,), over the time since the reading before."""
    dead_man: bool = False
    clutch: bool = False
    pedal: bool = False
    released: bool = False
    """The dead-man was seen released since the device came; before, pressing it means nothing."""
    last: DeviceReading | None = None
    """The reading before; None where it could not be used."""
    due: FloatArray = np.zeros(3)
    """m, shape (3,): what a pointer has moved and the hand has not yet."""
    problem: str = ""
    """Why the last reading could not be used."""


def rules_of(settings: DeviceSettings, usual: Usual) -> Rules:
    """Return how the settings let a device move the hand.

    Raises UserError for an axis that the device does not have, and for a button of two meanings.
    """
    axes = AxisMap(
        *(getattr(settings.axes, axis) or getattr(usual.axes, axis) for axis in AxisMap._fields)
    )
    for axis, name in zip(AxisMap._fields, axes, strict=True):
        if name != "none" and name.removeprefix("-") not in usual.has:
            raise UserError(
                f"device.axes.{axis}: this device has no axis {name.removeprefix('-')!r}: choose "
                f"of {', '.join(usual.has)}, with a minus sign for the other way, or none"
            )
    buttons = Buttons(
        *(getattr(settings.buttons, use) or getattr(usual.buttons, use) for use in Buttons._fields)
    )
    if len(set(buttons)) < len(buttons):
        raise UserError(
            f"device.buttons: dead_man {buttons.dead_man!r}, clutch {buttons.clutch!r} and pedal "
            f"{buttons.pedal!r} are not three different buttons: give each a button of its own"
        )
    return Rules(
        usual.kind,
        axes.matrix(),
        buttons,
        settings.scale_m_s,
        settings.dead_band,
        settings.jump,
        settings.m_per_pixel,
        settings.jump_pixels,
    )


def check_buttons(settings: DeviceSettings, rules: Rules, there: Sequence[str]) -> None:
    """Raise UserError where the dead-man, or a button that the settings name, is not there."""
    for use, name in zip(Buttons._fields, rules.buttons, strict=True):
        needed = use == "dead_man" or getattr(settings.buttons, use) is not None
        if needed and name not in there:
            raise UserError(
                f"device.buttons.{use}: this device has no button {name!r}: choose of "
                f"{', '.join(there) or 'another device, as this one has no buttons'}"
            )


def banded(deflection: FloatArray, dead_band: float) -> FloatArray:
    """Return each deflection without the dead band: 0 within, growing from 0 to ±1 beyond it."""
    beyond = np.maximum(np.abs(deflection) - dead_band, 0.0) / (1.0 - dead_band)
    return np.asarray(np.sign(deflection) * beyond)


def moved(hand: Hand, reading: DeviceReading, elapsed_s: float, rules: Rules) -> Hand:
    """Return the hand after a reading that came `elapsed_s` after the one before it."""
    held = rules.buttons.dead_man in reading.buttons
    problem = _problem(reading, rules)
    now = Hand(
        hand.position,
        dead_man=held and hand.released,
        clutch=rules.buttons.clutch in reading.buttons,
        pedal=rules.buttons.pedal in reading.buttons,
        released=hand.released or not held,
        last=None if problem else reading,
        problem=problem,
    )
    last = hand.last
    if problem or last is None or not (_moves(hand) and _moves(now)):
        return now
    elapsed_s = min(max(elapsed_s, 0.0), FOLLOW_S)
    if rules.kind == "rate":
        velocity = _velocity(last, reading, rules)
        return now._replace(velocity=velocity, position=hand.position + velocity * elapsed_s)
    due = _due(hand.due, last, reading, rules)
    velocity = due / FOLLOW_S
    way = velocity * elapsed_s
    return now._replace(velocity=velocity, position=hand.position + way, due=due - way)


def unplugged(hand: Hand) -> Hand:
    """Return the hand of a device that is gone: at rest, let go of, and to be let go of again."""
    return Hand(hand.position)


def _moves(hand: Hand) -> bool:
    return hand.dead_man and not hand.clutch


def _velocity(last: DeviceReading, reading: DeviceReading, rules: Rules) -> FloatArray:
    before, now = (rules.axes @ np.clip(each.axes, -1.0, 1.0) for each in (last, reading))
    if np.abs(now - before).max() > rules.jump:
        return np.zeros(3)
    return rules.scale_m_s * _limited(banded(now, rules.dead_band), 1.0)


def _due(due: FloatArray, last: DeviceReading, reading: DeviceReading, rules: Rules) -> FloatArray:
    assert last.pointer is not None
    assert reading.pointer is not None
    pixels = np.subtract(reading.pointer, last.pointer)
    if math.hypot(*pixels) > rules.jump_pixels:
        return np.zeros(3)
    way = rules.axes[:, : len(pixels)] @ pixels * rules.m_per_pixel
    # What is beyond the greatest speed is lost: the hand must not go on after the pointer stands.
    return _limited(due + way, rules.scale_m_s * FOLLOW_S)


def _limited(vector: FloatArray, most: float) -> FloatArray:
    length = float(np.linalg.norm(vector))
    return vector * (most / length) if length > most else vector


def _problem(reading: DeviceReading, rules: Rules) -> str:
    if len(reading.axes) != len(AXES):
        return f"tells {len(reading.axes)} axes, expected {len(AXES)}"
    for name, value in zip(AXES, reading.axes, strict=True):
        if not math.isfinite(value):
            return f"tells {value} for its axis {name}"
    if rules.kind == "position" and (
        reading.pointer is None or not all(map(math.isfinite, reading.pointer))
    ):
        return f"tells {reading.pointer} for the place of its pointer"
    return ""
