"""The operator's device at one moment: what every source of motion is asked for."""

from __future__ import annotations

import math
from typing import NamedTuple

from hmcs.arrays import Array

LIVE = math.inf
"""Duration of a source that has no end."""
FARTHEST_M = 1e4
"""No hand is farther from its zero, along any axis."""
FASTEST_M_S = 5.0
"""No hand moves faster."""


class DeviceSample(NamedTuple):
    """The operator's device at one moment; positions in the operator frame, see `Motion`."""

    position: Array
    """m, shape (3,)."""
    velocity: Array
    """m/s, shape (3,)."""
    dead_man: bool
    clutch: bool = False
    pedal: bool = False
    orientation: Array | None = None
    """x y z w, shape (4,)."""
    angular_velocity: Array | None = None
    """rad/s, shape (3,)."""
    wrench: Array | None = None
    """N and N·m, shape (6,)."""
    age_s: float | None = None
    """How long ago the device reported this; None where the source cannot know. A device whose
    reports stay out is no longer believed."""
