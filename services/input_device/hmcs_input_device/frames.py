"""Device and robot may stand turned against each other: samples are given in the robot's axes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.motion.quaternions import product, rotation_matrix
from hmcs_input_device.settings import InputDeviceSettings
from hmcs_input_device.sources import DeviceSample, SeesRobot, Source

IDENTITY = (0.0, 0.0, 0.0, 1.0)
"""No turn."""


class TaskFrame:
    """The frame the operator moves in, by how it is turned in the robot's base frame."""

    def __init__(self, orientation: tuple[float, float, float, float]) -> None:
        """Be turned by the quaternion `orientation`, x y z w.

        Raises ValueError where it is no rotation.
        """
        self._orientation = np.array(orientation)
        self._rotation = rotation_matrix(self._orientation)

    def in_base(self, sample: DeviceSample) -> DeviceSample:
        """Return a sample, given in the operator's frame, along the axes of the robot's base."""
        return sample._replace(
            position=self._rotation @ sample.position,
            velocity=self._rotation @ sample.velocity,
            orientation=None
            if sample.orientation is None
            else product(self._orientation, sample.orientation),
            angular_velocity=self._turned(sample.angular_velocity),
            wrench=None
            if sample.wrench is None
            else (self._rotation @ sample.wrench.reshape(2, 3).T).T.ravel(),
        )

    def _turned(self, vector: Array | None) -> Array | None:
        return None if vector is None else self._rotation @ vector


def frame_of(
    settings: InputDeviceSettings, source: Source
) -> Callable[[DeviceSample], DeviceSample]:
    """Return what tells a source's samples along the axes of the robot's base.

    Raises UserError for a source that has them already.
    """
    if settings.task_frame_xyzw == IDENTITY:
        return lambda sample: sample
    if isinstance(source, SeesRobot):
        raise UserError(
            f"task_frame_xyzw: the operator of {settings.source!r} sees the robot in its base "
            "frame: leave it out"
        )
    return TaskFrame(settings.task_frame_xyzw).in_base
