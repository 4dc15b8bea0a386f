"""What a ROS operator's messages say of the hand: pure functions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from hmcs.arrays import Array, shortened
from hmcs_ros2_bridge.fields import NonsenseError

LONGEST_TICK_S = 0.05
"""A hand is carried on for no longer by one velocity."""


class Switches(NamedTuple):
    """What is pressed."""

    dead_man: bool = False
    clutch: bool = False
    pedal: bool = False


class Hand(NamedTuple):
    """The hand as a source of motion carries it on from tick to tick."""

    position: Array = np.zeros(3)
    """m, shape (3,)."""
    twist: Array = np.zeros(6)
    """m/s and rad/s, shape (6,)."""


def switches_in(joy: Any, buttons: Sequence[int | None]) -> Switches:
    """Return what of a sensor_msgs/Joy is pressed: dead-man, clutch, pedal, by their indices.

    Raises NonsenseError where it has no such button.
    """
    pressed = []
    for index in buttons:
        if index is not None and index >= len(joy.buttons):
            raise NonsenseError(f"has {len(joy.buttons)} buttons, none with the index {index}")
        pressed.append(index is not None and joy.buttons[index] != 0)
    return Switches(*pressed)


def stick_in(joy: Any, axes: Sequence[int | None], dead_band: float) -> Array:
    """Return the deflection along x, y, z of a sensor_msgs/Joy, shares −1 to 1, shape (3,).

    What is within the `dead_band` is 0, beyond it the deflection grows from 0 on. Raises
    NonsenseError where it has no such axis, or one is not finite.
    """
    values = np.zeros(3)
    for place, index in enumerate(axes):
        if index is None:
            continue
        if index >= len(joy.axes):
            raise NonsenseError(f"has {len(joy.axes)} axes, none with the index {index}")
        values[place] = joy.axes[index]
    if not np.isfinite(values).all():
        raise NonsenseError("has an axis that is not finite")
    beyond = np.maximum(np.abs(values) - dead_band, 0.0) / (1.0 - dead_band)
    return shortened(np.sign(values) * beyond, 1.0)


def moved_by(hand: Hand, twist: Array, elapsed_s: float, switches: Switches) -> Hand:
    """Return the hand that goes on at `twist`, m/s and rad/s, shape (6,), while it is held."""
    if not switches.dead_man or switches.clutch:
        return Hand(hand.position)
    way_s = min(max(elapsed_s, 0.0), LONGEST_TICK_S)
    return Hand(hand.position + twist[:3] * way_s, twist)


def velocity_between(before: Array, now: Array, elapsed_s: float) -> Array:
    """Return the velocity from one position to the next, m/s, shape (3,); zero for no time."""
    if elapsed_s <= 0.0:
        return np.zeros(3)
    return np.asarray((now - before) / elapsed_s)
