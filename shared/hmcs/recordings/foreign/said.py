"""What single messages of other programs say: a pose, a velocity, joint positions, a force."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, NamedTuple

Kind = Literal["poses", "velocities", "joint positions", "force", "buttons"]
POSES: Kind = "poses"
VELOCITIES: Kind = "velocities"
JOINTS: Kind = "joint positions"
FORCES: Kind = "force"
BUTTONS: Kind = "buttons"


class NoSampleError(Exception):
    """A message that says nothing of the kind; says why."""


class Said(NamedTuple):
    """What a message says."""

    numbers: Sequence[float]
    """Position in m, or with a quaternion x y z w behind it; linear, then angular velocity; joint
    positions; force, then torque; buttons, 1 where pressed."""
    stamp_ns: int | None
    """When it was taken, ns since 1970; None where it does not say."""
    frame: str = ""
    names: Sequence[str] = ()
    """Of joints."""


def _pose(message: Any) -> list[float]:
    at, turn = message.position, message.orientation
    return [at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w]


def _transform(message: Any) -> list[float]:
    at, turn = message.translation, message.rotation
    return [at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w]


def _six(first: Any, second: Any) -> list[float]:
    return [first.x, first.y, first.z, second.x, second.y, second.z]


class _Reading(NamedTuple):
    kind: Kind
    numbers: Callable[[Any], Sequence[float]]


_READINGS: Mapping[str, _Reading] = {
    "geometry_msgs/msg/PoseStamped": _Reading(POSES, lambda m: _pose(m.pose)),
    "geometry_msgs/msg/PoseWithCovarianceStamped": _Reading(POSES, lambda m: _pose(m.pose.pose)),
    "geometry_msgs/msg/Pose": _Reading(POSES, _pose),
    "geometry_msgs/msg/PointStamped": _Reading(POSES, lambda m: [m.point.x, m.point.y, m.point.z]),
    "geometry_msgs/msg/TransformStamped": _Reading(POSES, lambda m: _transform(m.transform)),
    "nav_msgs/msg/Odometry": _Reading(POSES, lambda m: _pose(m.pose.pose)),
    "geometry_msgs/msg/TwistStamped": _Reading(
        VELOCITIES, lambda m: _six(m.twist.linear, m.twist.angular)
    ),
    "geometry_msgs/msg/Twist": _Reading(VELOCITIES, lambda m: _six(m.linear, m.angular)),
    "sensor_msgs/msg/JointState": _Reading(JOINTS, lambda m: m.position.tolist()),
    "geometry_msgs/msg/WrenchStamped": _Reading(
        FORCES, lambda m: _six(m.wrench.force, m.wrench.torque)
    ),
    "sensor_msgs/msg/Joy": _Reading(BUTTONS, lambda m: m.buttons.tolist()),
}
KINDS = tuple(name.rpartition("/")[2] for name in _READINGS)
"""Types of ROS that are read, without their packages."""


def kind_of(type_name: str) -> Kind | None:
    """Return what messages of a type of ROS say; None for those that are not read."""
    reading = _READINGS.get(type_name)
    return None if reading is None else reading.kind


def said_by(type_name: str, message: Any) -> Said:
    """Return what a message of ROS says whose type has a kind."""
    reading = _READINGS[type_name]
    header = getattr(message, "header", None)
    stamp_ns = None if header is None else header.stamp.sec * 10**9 + header.stamp.nanosec
    # Buttons and joints of several frames are no motion.
    frame = "" if header is None or reading.kind in (JOINTS, BUTTONS) else str(header.frame_id)
    names = tuple(message.name) if reading.kind == JOINTS else ()
    return Said(reading.numbers(message), stamp_ns, frame, names)


def said_in_json(fields: Mapping[str, Any]) -> Said:
    """Return the position, and orientation where it has one, in a message of JSON.

    As Foxglove's PoseInFrame has it, as a pose or transform of its own, or as x, y, z at the top.
    Raises NoSampleError where there is none.
    """
    pose: Mapping[str, Any] = _inner(fields, "pose", "transform") or fields
    place = _inner(pose, "position", "translation", "point") or pose
    numbers = _three(place)
    turn = _inner(pose, "orientation", "rotation", "quaternion")
    if turn is not None and all(axis in turn for axis in "xyzw"):
        numbers += [_number(turn[axis]) for axis in "xyzw"]
    frame = fields.get("frame_id", "")
    return Said(numbers, _stamp_ns(fields), frame if isinstance(frame, str) else "")


def _three(fields: Mapping[str, Any]) -> list[float]:
    if not {"x", "y"} <= fields.keys():
        raise NoSampleError("has no x and y")
    return [_number(fields.get(axis, 0.0)) for axis in "xyz"]


def _inner(fields: Mapping[str, Any], *names: str) -> Mapping[str, Any] | None:
    found = (fields.get(name) for name in names)
    return next((each for each in found if isinstance(each, dict)), None)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise NoSampleError(f"has {str(value)[:40]!r} in place of a number")
    try:
        return float(value)
    except OverflowError as error:
        raise NoSampleError("has a number that is too large") from error


def _stamp_ns(fields: Mapping[str, Any]) -> int | None:
    header = _inner(fields, "header") or fields
    stamp = _inner(header, "timestamp", "stamp")
    if stamp is None:
        return None
    sec, nsec = stamp.get("sec"), stamp.get("nsec", stamp.get("nanosec", 0))
    return sec * 10**9 + nsec if isinstance(sec, int) and isinstance(nsec, int) else None
