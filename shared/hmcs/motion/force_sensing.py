"""What a force sensor between the last link and the tool reads, and what of it is the operator's.

Readings are in the frame of the tool, the operator's force is in the base frame; torques are about
the origin of the tool frame.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hmcs.arrays import Array
from hmcs.motion.quaternions import rotation_matrix

GRAVITY_M_S2 = np.array([0.0, 0.0, -9.81])


class Payload(NamedTuple):
    """What hangs on the sensor."""

    mass_kg: float
    center_m: tuple[float, float, float]
    """Of its mass, tool frame."""

    def weight(self, orientation: ArrayLike) -> Array:
        """Return its force, N, and torque, N·m, on the sensor, tool frame, shape (6,).

        For a tool turned by the quaternion `orientation`, x y z w, base frame.
        """
        force = self.mass_kg * (rotation_matrix(orientation).T @ GRAVITY_M_S2)
        return np.concatenate([force, np.cross(self.center_m, force)])


class ForceSensor:
    """Low-passes what acts on the tool, as the electronics of a real one do."""

    def __init__(self, bandwidth_hz: float) -> None:
        """Pass what is slower than `bandwidth_hz` (−3 dB). Raises ValueError unless above 0."""
        if not bandwidth_hz > 0:
            raise ValueError(f"bandwidth_hz is {bandwidth_hz}, expected more than 0")
        self._rate_per_s = 2.0 * math.pi * bandwidth_hz
        self._reading: Array | None = None

    def read(self, wrench: Array, elapsed_s: float) -> Array:
        """Return the reading `elapsed_s` after the one before, for a wrench, tool frame, (6,)."""
        if self._reading is None:
            self._reading = wrench
        share = 1.0 - math.exp(-self._rate_per_s * elapsed_s)
        self._reading = self._reading + share * (wrench - self._reading)
        return self._reading


def sensed(wrench: Array, payload: Payload, orientation: ArrayLike) -> Array:
    """Return what acts on the sensor, tool frame, for an operator's wrench, base frame, (6,)."""
    return _turned(rotation_matrix(orientation).T, wrench) + payload.weight(orientation)


def operator_wrench(reading: Array, payload: Payload, orientation: ArrayLike) -> Array:
    """Return the operator's force, N, and torque, N·m, base frame, shape (6,): without gravity."""
    return _turned(rotation_matrix(orientation), reading - payload.weight(orientation))


def _turned(rotation: Array, wrench: Array) -> Array:
    return np.concatenate([rotation @ wrench[:3], rotation @ wrench[3:]])
