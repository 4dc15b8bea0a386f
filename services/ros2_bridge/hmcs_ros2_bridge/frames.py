"""Where frames of ROS are, by the newest transforms of tf2_msgs/TFMessage.

Each transform is the pose of a child in its parent; a child has one parent.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hmcs.arms.state import Pose
from hmcs.arrays import Array
from hmcs.motion.quaternions import from_matrix, rotation_matrix, unit_quaternion
from hmcs_ros2_bridge.fields import NonsenseError, vector_in

MOST_FRAMES = 1000
"""Frames that are kept; more are left out."""


class Transform(NamedTuple):
    """The pose of a frame in its parent."""

    parent: str
    frame: Array
    """Homogeneous, m, shape (4, 4)."""
    stamp_s: float | None
    """By the sender's clock; None of one that stays."""


class Frames:
    """The newest transform of each frame."""

    def __init__(self) -> None:
        self._by_child: dict[str, Transform] = {}

    def take(self, message: Any, *, stays: bool) -> None:
        """Take in a message of /tf, or of /tf_static, whose transforms stay.

        Raises NonsenseError for one that is no transform.
        """
        for each in message.transforms:
            child, parent = _named(each.child_frame_id), _named(each.header.frame_id)
            if child not in self._by_child and len(self._by_child) >= MOST_FRAMES:
                continue
            stamp = each.header.stamp
            stamp_s = None if stays else stamp.sec + stamp.nanosec * 1e-9
            self._by_child[child] = Transform(parent, _frame_of(each.transform), stamp_s)

    def pose(self, frame: str, base: str) -> tuple[Pose, float] | None:
        """Return the pose of a frame in another above it, and the oldest stamp on the way, s.

        None where none leads there yet, or all that do stay: then nothing is said of now.
        """
        at, pose, stamps_s = _named(frame), np.eye(4), list[float]()
        passed = set[str]()
        while at != _named(base):
            transform = self._by_child.get(at)
            if transform is None or at in passed:
                return None
            passed.add(at)
            pose = transform.frame @ pose
            if transform.stamp_s is not None:
                stamps_s.append(transform.stamp_s)
            at = transform.parent
        if not stamps_s:
            return None
        return Pose(pose[:3, 3], from_matrix(pose[:3, :3])), min(stamps_s)


def _named(frame: str) -> str:
    return frame.removeprefix("/")


def _frame_of(transform: Any) -> Array:
    turned = transform.rotation
    values = np.array([turned.x, turned.y, turned.z, turned.w])
    frame = np.eye(4)
    frame[:3, 3] = vector_in(transform.translation)
    try:
        frame[:3, :3] = rotation_matrix(unit_quaternion(values))
    except ValueError as error:
        raise NonsenseError(str(error)) from None
    return frame
