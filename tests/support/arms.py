"""Arms as parameters of tests: descriptions that come with PyBullet are not on every Python."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hmcs.arms.limits import Limits
from hmcs.arms.state import JointLimits
from hmcs_robot.robots import ROBOTS

ABSENT = "its description comes with PyBullet, which is not installed"


def arm(name: str, *more: Any) -> Any:
    """Return a parameter that begins with an arm's name, skipped where the arm is not there."""
    marks = pytest.mark.skipif(name not in ROBOTS, reason=f"{name}: {ABSENT}")
    return pytest.param(name, *more, marks=marks)


def needs(name: str) -> Any:
    """Return a mark that skips a test where an arm is not there."""
    return pytest.mark.skipif(name not in ROBOTS, reason=f"{name}: {ABSENT}")


def limits_about(joints: JointLimits, middle_m: np.ndarray[Any, Any], half_m: float) -> Limits:
    """Return the limits of an arm in a cube about a point, m, shape (3,)."""
    return Limits(
        joints=joints,
        speed_m_s=0.25,
        angular_speed_rad_s=0.5,
        workspace_lower_m=middle_m - half_m,
        workspace_upper_m=middle_m + half_m,
    )
