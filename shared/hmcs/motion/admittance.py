"""A robot led by the hand gives way to a force: the admittance of section 4.3."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.dead_band import beyond


@dataclass(frozen=True)
class Admittance:
    """Velocity proportional to what of a force is beyond a threshold, and so for torque.

    The thesis (4.3) jumps from rest to the full speed of the threshold; here the threshold is taken
    off the force, so that the robot sets out without a kick. Raises ValueError for a threshold
    below 0 or a gain that is not above 0.
    """

    force_threshold_n: float = 2.0
    torque_threshold_n_m: float = 0.2
    m_s_per_n: float = 0.01
    rad_s_per_n_m: float = 0.2

    def __post_init__(self) -> None:
        for name in ("force_threshold_n", "torque_threshold_n_m"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name} is {getattr(self, name)}, expected 0 or more")
        for name in ("m_s_per_n", "rad_s_per_n_m"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} is {getattr(self, name)}, expected more than 0")

    def twist(self, wrench: Array) -> Array:
        """Return the velocity, m/s and rad/s, that a force and torque ask for, shapes (6,)."""
        return np.concatenate(
            [
                self.m_s_per_n * beyond(wrench[:3], self.force_threshold_n),
                self.rad_s_per_n_m * beyond(wrench[3:], self.torque_threshold_n_m),
            ]
        )

    def wrench(self, twist: Array) -> Array:
        """Return the force, N, and torque, N·m, that ask for a velocity, shapes (6,)."""
        return np.concatenate(
            [
                _raised(twist[:3] / self.m_s_per_n, self.force_threshold_n),
                _raised(twist[3:] / self.rad_s_per_n_m, self.torque_threshold_n_m),
            ]
        )


def _raised(vector: Array, threshold: float) -> Array:
    length = float(np.linalg.norm(vector))
    return np.asarray(vector * (1.0 + threshold / length)) if length > 0 else vector
