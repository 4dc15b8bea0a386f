"""The operator's hand: samples of an input device, and the handle on an operator's page."""

from __future__ import annotations

from hmcs.bus.arrays import Quaternion, Vector3, Vector6
from hmcs.bus.messages.fields import Name
from hmcs.bus.messages.message import Message


class Motion(Message):
    """One sample of the operator's device."""

    SCHEMA = "motion"

    position: Vector3
    """Of the hand, m, operator frame, shape (3,)."""
    velocity: Vector3
    """Of the hand, m/s, shape (3,)."""
    orientation: Quaternion | None = None
    """Of the hand, x y z w, shape (4,); None where the device has none."""
    angular_velocity: Vector3 | None = None
    """rad/s, shape (3,); None where the device has none."""
    wrench: Vector6 | None = None
    """The operator's force, N, then torque, N·m, shape (6,); None where the device has none."""
    dead_man: bool
    """True while the operator holds the enabling switch: without it the robot does not move."""
    clutch: bool = False
    """True while the hand is being repositioned: the robot stays where it is."""
    pedal: bool = False
    """A second switch, for marking and for explicit cues."""


class Handle(Message):
    """What an operator's page does with its handle; an input device makes Motion of it."""

    SCHEMA = "handle"

    operator: Name
    """Who holds it: one page of one console. Another's is refused until this one has lapsed."""
    position: Vector3
    """Of the handle, m, operator frame, shape (3,)."""
    dead_man: bool
    """True while it is held."""
    clutch: bool = False
    """True while the handle is being repositioned."""
    pedal: bool = False
    """The page's pedal key."""
