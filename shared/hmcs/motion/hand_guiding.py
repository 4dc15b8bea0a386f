"""A simulated hand that leads a robot by its tool, through a force sensor and an admittance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.admittance import Admittance
from hmcs.motion.force_sensing import ForceSensor, Payload, operator_wrench, sensed
from hmcs.task import Task

FASTEST_M_S = 5.0
"""No hand wants to go faster along any axis: what asks for more is no hand's."""


class AdmittanceResponse(NamedTuple):
    """What comes of a push."""

    wrench: Array
    """The operator's force, N, and torque, N·m, as it was sensed, base frame, shape (6,)."""
    twist: Array
    """The velocity it asks for, m/s and rad/s, shape (6,)."""


class HandGuiding:
    """Pushes as hard as the arm needs to go as the hand wants; the sensor has the last word.

    A velocity that is none, or is not finite, is no push, and the sensor begins anew after it.
    """

    def __init__(self, admittance: Admittance, payload: Payload, bandwidth_hz: float) -> None:
        self._admittance = admittance
        self._payload = payload
        self._bandwidth_hz = bandwidth_hz
        self._sensor = ForceSensor(bandwidth_hz)

    def push(self, velocity: Array, orientation: Array, elapsed_s: float) -> AdmittanceResponse:
        """Push for `elapsed_s` to go at `velocity`, m/s, shape (3,).

        The tool is turned by the quaternion `orientation`, x y z w, base frame.
        """
        if not (np.abs(velocity).max() <= FASTEST_M_S and elapsed_s >= 0.0):
            self._sensor = ForceSensor(self._bandwidth_hz)
            return AdmittanceResponse(np.zeros(6), np.zeros(6))
        wanted = self._admittance.wrench(np.concatenate([velocity, np.zeros(3)]))
        reading = self._sensor.read(sensed(wanted, self._payload, orientation), elapsed_s)
        wrench = operator_wrench(reading, self._payload, orientation)
        return AdmittanceResponse(wrench, self._admittance.twist(wrench))


def hand_guiding_of(task: Task) -> HandGuiding | None:
    """Return the hand that leads the robot of a task by its tool; None where it is teleoperated."""
    if task.robot.mode == "teleoperated":
        return None
    set_up = task.robot.cooperation
    return HandGuiding(
        Admittance(
            set_up.force_threshold_n,
            set_up.torque_threshold_n_m,
            set_up.m_s_per_n,
            set_up.rad_s_per_n_m,
        ),
        Payload(set_up.tool_mass_kg, set_up.tool_center_m),
        set_up.sensor_bandwidth_hz,
    )
