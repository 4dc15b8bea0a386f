"""From what a device says to the motion of a hand: pure, one reading after another.

A reading moves the hand only together with the one before it: both usable, both with a dead-man
that counts and no clutch, and near each other. Whatever else happens, the hand rests.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs_input_device.devices.reading import AXES, DeviceReading
from hmcs_input_device.settings import AxisName, DeviceSettings
from hmcs_input_device.sources import FARTHEST_M

FOLLOW_S = 0.08
"""Time constant with which the hand follows a pointer, which sends its place in jerks; also the
longest time that one reading moves the hand for: nobody knows what a device did meanwhile."""
FARTHEST_PIXELS = 1e6
"""No screen is larger."""
LEAST_REST = 0.05
"""Share of the full deflection within which an axis is at rest even without a dead band."""
FLIP = 1.5
"""No hand moves an axis by so much of its full deflection from one reading to the next."""

Kind = Literal["rate", "position"]
"""A deflection is a velocity; a way of the pointer is a way of the hand."""


class AxisMap(NamedTuple):
    """Which axis of the device moves the hand along each axis of the operator frame."""

    x: AxisName
    y: AxisName
    z: AxisName

    def matrix(self) -> Array:
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


class Silence(NamedTuple):
    """For how long a device may say nothing while its dead-man is held, before it is not believed.

    Of no device it is known whether it lives while it is silent; each is silent otherwise.
    """

    deflected_s: float = 1.0
    """While it moves the hand."""
    resting_s: float = 10.0
    """While its axes are at rest: some plans move the robot all the same."""


class Usual(NamedTuple):
    """How a kind of device is used where the settings do not say it."""

    kind: Kind
    axes: AxisMap
    buttons: Buttons
    has: tuple[str, ...] = AXES
    """Axes that it has, of AXES."""
    silence: Silence = Silence()
    switches: bool = False
    """Whether its axes are switches, which go from one end to the other at once."""


class Rules(NamedTuple):
    """How a device moves the hand."""

    kind: Kind
    axes: Array
    """Shape (3, 6), see `AxisMap.matrix`."""
    buttons: Buttons
    scale_m_s: float
    dead_band: float
    jump: float
    m_per_pixel: float
    jump_pixels: float
    silence: Silence
    switches: bool


class Hand(NamedTuple):
    """The hand that a device moves, and what the next reading is judged by."""

    position: Array = np.zeros(3)
    """m, operator frame, shape (3,): the integral of its velocities."""
    velocity: Array = np.zeros(3)
    """m/s, shape (3,), over the time since the reading before."""
    dead_man: bool = False
    clutch: bool = False
    pedal: bool = False
    last: DeviceReading | None = None
    """The reading before; None where it could not be used."""
    due: Array = np.zeros(3)
    """m, shape (3,): what a pointer has moved and the hand has not yet."""


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
        Silence(
            settings.deflected_silence_s or usual.silence.deflected_s,
            settings.resting_silence_s or usual.silence.resting_s,
        ),
        usual.switches,
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


def banded(deflection: Array, dead_band: float) -> Array:
    """Return each deflection without the dead band: 0 within, growing from 0 to ±1 beyond it."""
    beyond = np.maximum(np.abs(deflection) - dead_band, 0.0) / (1.0 - dead_band)
    return np.asarray(np.sign(deflection) * beyond)


def moved(
    hand: Hand, reading: DeviceReading, elapsed_s: float, rules: Rules, *, dead_man: bool
) -> Hand:
    """Return the hand after a usable reading that came `elapsed_s` after the one before it.

    `dead_man` is whether its dead-man is held and counts.
    """
    now = Hand(
        hand.position,
        dead_man=dead_man,
        clutch=rules.buttons.clutch in reading.buttons,
        pedal=rules.buttons.pedal in reading.buttons,
        last=reading,
    )
    last = hand.last
    if last is None or not (_moves(hand) and _moves(now)):
        return now
    elapsed_s = min(max(elapsed_s, 0.0), FOLLOW_S)
    if rules.kind == "rate":
        velocity, due = _velocity(last, reading, rules), np.zeros(3)
    else:
        due = _due(hand.due, last, reading, rules)
        velocity = due / FOLLOW_S
    way = velocity * elapsed_s
    if not np.abs(hand.position + way).max() <= FARTHEST_M:
        return now
    due = due - way if rules.kind == "position" else due
    return now._replace(velocity=velocity, position=hand.position + way, due=due)


def resting(hand: Hand) -> Hand:
    """Return the hand of a device that cannot be believed: at rest, and let go of."""
    return Hand(hand.position)


def deflected(reading: DeviceReading, rules: Rules) -> str:
    """Return the name and value of an axis that moves the hand and is not at rest; else empty."""
    if rules.kind == "position":
        return ""
    for name, value, column in zip(AXES, reading.axes, rules.axes.T, strict=True):
        if column.any() and abs(value) > max(rules.dead_band, LEAST_REST):
            return f"axis {name} ({value:.2f})"
    return ""


def problem_with(last: DeviceReading | None, reading: DeviceReading, rules: Rules) -> str:
    """Return why a reading after `last` cannot be used; empty where it can."""
    if len(reading.axes) != len(AXES):
        return f"has {len(reading.axes)} axes, expected {len(AXES)}"
    for name, value in zip(AXES, reading.axes, strict=True):
        if not math.isfinite(value):
            return f"gives {value} for its axis {name}"
    if rules.kind == "position":
        return _pointer_problem(reading)
    if last is None or rules.switches:
        return ""
    change = rules.axes @ np.subtract(_clipped(reading), _clipped(last))
    return f"jumped by {np.abs(change).max():.2f}" if np.abs(change).max() > FLIP else ""


def _moves(hand: Hand) -> bool:
    return hand.dead_man and not hand.clutch


def _clipped(reading: DeviceReading) -> Array:
    return np.clip(reading.axes, -1.0, 1.0)


def _velocity(last: DeviceReading, reading: DeviceReading, rules: Rules) -> Array:
    before, now = (rules.axes @ _clipped(each) for each in (last, reading))
    if np.abs(now - before).max() > rules.jump:
        return np.zeros(3)
    return rules.scale_m_s * _limited(banded(now, rules.dead_band), 1.0)


def _due(due: Array, last: DeviceReading, reading: DeviceReading, rules: Rules) -> Array:
    assert last.pointer is not None
    assert reading.pointer is not None
    pixels = np.subtract(reading.pointer, last.pointer)
    if math.hypot(*pixels) > rules.jump_pixels:
        return np.zeros(3)
    way = rules.axes[:, : len(pixels)] @ pixels * rules.m_per_pixel
    # What is beyond the greatest speed is lost: the hand must not go on after the pointer stands.
    return _limited(due + way, rules.scale_m_s * FOLLOW_S)


def _limited(vector: Array, most: float) -> Array:
    length = float(np.linalg.norm(vector))
    return vector * (most / length) if length > most else vector


def _pointer_problem(reading: DeviceReading) -> str:
    pointer = reading.pointer
    if pointer is None or not all(abs(place) <= FARTHEST_PIXELS for place in pointer):
        return f"gives {pointer} for the place of its pointer"
    return ""
