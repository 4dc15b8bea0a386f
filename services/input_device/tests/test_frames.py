"""A device that stands turned against the robot."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from hmcs_input_device.frames import TaskFrame
from hmcs_input_device.settings import InputDeviceSettings
from hmcs_input_device.sources import DeviceSample


def test_everything_of_a_sample_is_reported_along_the_axes_of_the_robot() -> None:
    turn = Rotation.from_rotvec([0.3, -0.5, 1.1])
    held = Rotation.from_rotvec([0.1, 0.2, -0.4])
    sample = DeviceSample(
        np.array([0.1, 0.2, 0.3]),
        np.array([1.0, 0.0, -1.0]),
        dead_man=True,
        pedal=True,
        orientation=held.as_quat(),
        angular_velocity=np.array([0.0, 2.0, 0.5]),
        wrench=np.array([1.0, 2.0, 3.0, 0.1, 0.2, 0.3]),
    )
    reported = TaskFrame(tuple(turn.as_quat())).in_base(sample)
    np.testing.assert_allclose(reported.position, turn.apply(sample.position))
    np.testing.assert_allclose(reported.velocity, turn.apply(sample.velocity))
    np.testing.assert_allclose(reported.angular_velocity, turn.apply([0.0, 2.0, 0.5]))
    np.testing.assert_allclose(reported.wrench[:3], turn.apply([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(reported.wrench[3:], turn.apply([0.1, 0.2, 0.3]))
    between = Rotation.from_quat(reported.orientation).inv() * (turn * held)
    assert between.magnitude() < 1e-12
    assert reported.dead_man
    assert reported.pedal


def test_what_is_not_reported_stays_unknown() -> None:
    sample = DeviceSample(np.zeros(3), np.zeros(3), dead_man=False)
    reported = TaskFrame((0.0, 0.0, 1.0, 0.0)).in_base(sample)
    assert reported.orientation is None
    assert reported.angular_velocity is None
    assert reported.wrench is None


def test_a_frame_that_is_no_rotation_is_refused() -> None:
    with pytest.raises(ValidationError, match="no unit quaternion"):
        InputDeviceSettings(task_frame_xyzw=(1.0, 1.0, 0.0, 0.0))
