"""Parts of ROS messages as plain mappings of their fields, there and back.

SI units, right-handed frames, quaternions x y z w, twists linear then angular: on both sides of the
bridge, so that all of it is a renaming.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.quaternions import unit_quaternion

Fields = dict[str, Any]
"""Fields of a ROS message by name; messages within it are mappings, too."""


class NonsenseError(ValueError):
    """A ROS message holds what cannot be; says what."""


def header(stamp_ns: int, frame: str) -> Fields:
    """Return a std_msgs/Header."""
    return {"stamp": stamp(stamp_ns), "frame_id": frame}


def stamp(time_ns: int) -> Fields:
    """Return a builtin_interfaces/Time."""
    return {"sec": time_ns // 1_000_000_000, "nanosec": time_ns % 1_000_000_000}


def vector(values: Iterable[float]) -> Fields:
    """Return a geometry_msgs/Vector3 or Point of three numbers."""
    return dict(zip("xyz", map(float, values), strict=True))


def pose(position: Iterable[float], orientation: Iterable[float]) -> Fields:
    """Return a geometry_msgs/Pose of m and x y z w."""
    return {
        "position": vector(position),
        "orientation": dict(zip("xyzw", map(float, orientation), strict=True)),
    }


def twist(values: Array) -> Fields:
    """Return a geometry_msgs/Twist of m/s and rad/s, shape (6,)."""
    return {"linear": vector(values[:3]), "angular": vector(values[3:])}


def vector_in(message: Any) -> Array:
    """Return x, y, z of a ROS message, shape (3,); raises NonsenseError unless finite."""
    return _finite("a vector", np.array([message.x, message.y, message.z]))


def twist_in(message: Any) -> Array:
    """Return a geometry_msgs/Twist as m/s and rad/s, shape (6,).

    Raises NonsenseError unless finite.
    """
    return np.concatenate([vector_in(message.linear), vector_in(message.angular)])


def wrench_in(message: Any) -> Array:
    """Return a geometry_msgs/Wrench as N and N·m, shape (6,).

    Raises NonsenseError unless finite.
    """
    return np.concatenate([vector_in(message.force), vector_in(message.torque)])


def pose_in(message: Any) -> tuple[Array, Array]:
    """Return a geometry_msgs/Pose: m, shape (3,), and x y z w of length one, shape (4,).

    Raises NonsenseError where a number is not finite or the quaternion is no rotation.
    """
    turned = message.orientation
    values = _finite("an orientation", np.array([turned.x, turned.y, turned.z, turned.w]))
    try:
        return vector_in(message.position), unit_quaternion(values)
    except ValueError as error:
        raise NonsenseError(str(error)) from None


def check_frame(message: Any, frames: Iterable[str]) -> None:
    """Raise NonsenseError for a stamped message in a frame that is none of `frames`."""
    frame, known = message.header.frame_id.removeprefix("/"), tuple(frames)
    if frame not in known:
        raise NonsenseError(f"is in the frame {frame[:60]!r}, expected {' or '.join(known)}")


def _finite(what: str, values: Array) -> Array:
    if not np.isfinite(values).all():
        raise NonsenseError(f"has {what} that is not finite")
    return values
