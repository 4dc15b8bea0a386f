"""Arms as parameters of tests: descriptions that come with PyBullet are not on every Python."""

from __future__ import annotations

from typing import Any

import pytest

from hmcs_robot.robots import ROBOTS

ABSENT = "its description comes with PyBullet, which is not installed"


def arm(name: str, *more: Any) -> Any:
    """Return a parameter that begins with an arm's name, skipped where the arm is not there."""
    marks = pytest.mark.skipif(name not in ROBOTS, reason=f"{name}: {ABSENT}")
    return pytest.param(name, *more, marks=marks)


def needs(name: str) -> Any:
    """Return a mark that skips a test where an arm is not there."""
    return pytest.mark.skipif(name not in ROBOTS, reason=f"{name}: {ABSENT}")
