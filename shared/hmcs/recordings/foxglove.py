"""Messages in Foxglove's own schemas, so that its viewer shows them in space without any set-up.

Poses, a path and joint states, beside the messages they are made of; readers of recordings pass
over these channels. Schemas as published at https://github.com/foxglove/foxglove-sdk.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Any, NamedTuple

from hmcs.bus.messages import Motion, RobotState
from hmcs.bus.wire import schema_of

PREFIX = "/foxglove/"
"""Of the topics."""
BASE, OPERATOR = "base", "operator"
"""Frames: of the robot's base, and of the operator's device."""
SHOWN_EVERY_NS = 33_000_000
"""A pose or a posture is written once in such a time: more than that nobody sees."""
TRAIL_POSES = 200
"""So many poses of the tool make the path."""
TRAIL_EVERY_NS = 100_000_000
"""The path grows by a pose in such a time..."""
TRAIL_TOLD_NS = 1_000_000_000
"""...and is written as a whole once in such a time."""

MOST_UNDESCRIBED = 16
"""So many robots are noted of which nobody said how they look."""

_TIME = {
    "type": "object",
    "title": "time",
    "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
}
_VECTOR = {"type": "object", "properties": {axis: {"type": "number"} for axis in "xyz"}}
_TURN = {"type": "object", "properties": {axis: {"type": "number"} for axis in "xyzw"}}
_POSE = {"type": "object", "properties": {"position": _VECTOR, "orientation": _TURN}}
_STAMPED = {"timestamp": _TIME, "frame_id": {"type": "string"}}
SCHEMAS: dict[str, dict[str, Any]] = {
    "foxglove.PoseInFrame": {"type": "object", "properties": {**_STAMPED, "pose": _POSE}},
    "foxglove.PosesInFrame": {
        "type": "object",
        "properties": {**_STAMPED, "poses": {"type": "array", "items": _POSE}},
    },
    "foxglove.JointStates": {
        "type": "object",
        "properties": {
            "timestamp": _TIME,
            "joints": {
                "type": "array",
                "items": {
                    "type": "object",
                    "properties": {
                        "name": {"type": "string"},
                        "position": {"type": "number"},
                        "velocity": {"type": "number"},
                    },
                },
            },
        },
    },
}
"""JSON Schema by name."""
_MOTION, _ROBOT_STATE = schema_of(Motion), schema_of(RobotState)
_UPRIGHT = [0.0, 0.0, 0.0, 1.0]


class FoxgloveMessage(NamedTuple):
    """One message in a schema of Foxglove's."""

    topic: str
    schema: str
    fields: dict[str, Any]


class FoxgloveConverter:
    """Makes them of the messages of one recording, in their order."""

    def __init__(self) -> None:
        self._trail: deque[dict[str, Any]] = deque(maxlen=TRAIL_POSES)
        self._grown_ns = self._told_ns = -TRAIL_TOLD_NS
        self._shown_ns: dict[str, int] = {}
        self._joints: dict[str, tuple[str, ...]] = {}
        self.undescribed: set[str] = set()
        """Robots of which nobody said how they look. Joints that no state names either are not
        shown: a viewer moves a robot's model by the names in its description alone."""

    def name_joints(self, robot: str, joints: tuple[str, ...]) -> None:
        """Note what a robot's description calls its joints, in the order of their positions."""
        self._joints[robot] = joints
        self.undescribed.discard(robot)

    def of(self, fields: dict[str, Any], log_ns: int) -> Iterator[FoxgloveMessage]:
        """Yield what is to be shown of a message, by its fields as `fields_of` gives them."""
        schema = fields["schema"]
        if schema not in (_MOTION, _ROBOT_STATE):
            return
        if log_ns - self._shown_ns.get(schema, -SHOWN_EVERY_NS) < SHOWN_EVERY_NS:
            return
        self._shown_ns[schema] = log_ns
        if schema == _MOTION:
            turned = fields.get("orientation") or _UPRIGHT
            pose = _pose(fields["position"], turned)
            yield FoxgloveMessage(
                f"{PREFIX}hand", "foxglove.PoseInFrame", _in_frame(log_ns, OPERATOR, pose)
            )
            return
        pose = _pose(fields["tool_position"], fields["tool_orientation"])
        yield FoxgloveMessage(
            f"{PREFIX}tool", "foxglove.PoseInFrame", _in_frame(log_ns, BASE, pose)
        )
        states = self._joint_states(fields, log_ns)
        yield FoxgloveMessage(f"{PREFIX}joints", "foxglove.JointStates", states)
        if log_ns - self._grown_ns >= TRAIL_EVERY_NS:
            self._grown_ns = log_ns
            self._trail.append(pose)
        if log_ns - self._told_ns >= TRAIL_TOLD_NS:
            self._told_ns = log_ns
            trail = {"timestamp": _time(log_ns), "frame_id": BASE, "poses": list(self._trail)}
            yield FoxgloveMessage(f"{PREFIX}trail", "foxglove.PosesInFrame", trail)

    def _joint_states(self, fields: dict[str, Any], log_ns: int) -> dict[str, Any]:
        """Its joints, where the state or somebody else names them."""
        robot, positions = fields["robot"], fields["joint_positions"]
        velocities = fields["joint_velocities"]
        names = fields.get("joint_names") or self._joints.get(robot, ())
        if robot not in self._joints and len(self.undescribed) < MOST_UNDESCRIBED:
            self.undescribed.add(robot)
        if not len(names) == len(positions) == len(velocities):
            names = ()
        joints = [
            {"name": name, "position": position, "velocity": velocity}
            for name, position, velocity in zip(names, positions, velocities, strict=False)
        ]
        return {"timestamp": _time(log_ns), "joints": joints}


def _time(log_ns: int) -> dict[str, int]:
    return {"sec": log_ns // 1_000_000_000, "nsec": log_ns % 1_000_000_000}


def _pose(position: list[float], orientation: list[float]) -> dict[str, Any]:
    return {
        "position": dict(zip("xyz", position, strict=True)),
        "orientation": dict(zip("xyzw", orientation, strict=True)),
    }


def _in_frame(log_ns: int, frame: str, pose: dict[str, Any]) -> dict[str, Any]:
    return {"timestamp": _time(log_ns), "frame_id": frame, "pose": pose}
