"""What ROS sees of the cell: messages of the bus as fields of ROS messages."""

from __future__ import annotations

import json
from typing import NamedTuple

import numpy as np

from hmcs.bus.messages import Belief, FixtureState, Motion, RobotState
from hmcs.bus.messages.message import Message
from hmcs_ros2_bridge.fields import Fields, header, pose

OK, WARN, ERROR, STALE = b"\x00", b"\x01", b"\x02", b"\x03"
"""Levels of diagnostics, as in diagnostic_msgs/DiagnosticStatus."""
QUIET: tuple[str, ...] = ("none", "disengaged", "no_command")
"""Reasons to stand that are no fault."""
USUAL: tuple[str, ...] = ("guiding", "unsure", "disengaged")
"""Reasons of the fixture that are no fault."""


class Seen(NamedTuple):
    """The newest of each kind of message; None where there is none, or it is old."""

    robot: RobotState | None = None
    fixture: FixtureState | None = None
    belief: Belief | None = None
    motion: Motion | None = None


def json_of(message: Message) -> Fields:
    """Return a std_msgs/String with a message as JSON, its arrays as lists."""
    return {"data": json.dumps(dict(message), default=np.ndarray.tolist)}


def joint_state(state: RobotState, stamp_ns: int, frame: str) -> Fields:
    """Return a sensor_msgs/JointState; joints without names get `joint_1` and so on."""
    count = len(state.joint_positions)
    names = state.joint_names or tuple(f"joint_{number + 1}" for number in range(count))
    return {
        "header": header(stamp_ns, frame),
        "name": list(names),
        "position": state.joint_positions.tolist(),
        "velocity": state.joint_velocities.tolist(),
    }


def tool_pose(state: RobotState, stamp_ns: int, frame: str) -> Fields:
    """Return a geometry_msgs/PoseStamped of the robot's tool."""
    return {
        "header": header(stamp_ns, frame),
        "pose": pose(state.tool_position, state.tool_orientation),
    }


def hand_pose(motion: Motion, stamp_ns: int, frame: str) -> Fields:
    """Return a geometry_msgs/PoseStamped of the operator's hand."""
    turned = (0.0, 0.0, 0.0, 1.0) if motion.orientation is None else motion.orientation
    return {"header": header(stamp_ns, frame), "pose": pose(motion.position, turned)}


def diagnostics(seen: Seen, services: tuple[str, ...], stamp_ns: int) -> Fields:
    """Return a diagnostic_msgs/DiagnosticArray of the cell."""
    statuses = [
        _status("hmcs: operator", *_operator(seen.motion)),
        _status("hmcs: recognition", *_recognition(seen.belief)),
        _status("hmcs: fixture", *_fixture(seen.fixture)),
        _status("hmcs: robot", *_robot(seen.robot)),
        _status("hmcs: services", OK, ", ".join(services), {"count": str(len(services))}),
    ]
    return {"header": header(stamp_ns, ""), "status": statuses}


_Told = tuple[bytes, str, dict[str, str]]


def _operator(motion: Motion | None) -> _Told:
    if motion is None:
        return STALE, "no input device", {}
    held = "holds the dead-man" if motion.dead_man else "does not hold the dead-man"
    return OK, held, {"clutch": str(motion.clutch).lower()}


def _recognition(belief: Belief | None) -> _Told:
    if belief is None:
        return STALE, "no belief: a hand at rest makes no steps", {}
    values = {
        name: f"{share:.3f}"
        for name, share in zip(belief.states, belief.probabilities, strict=True)
    }
    values["unknown"] = f"{belief.unknown:.3f}"
    if belief.missing_gestemes:
        return WARN, f"no evidence for {', '.join(belief.missing_gestemes)}", values
    if belief.unknown_alarm:
        return WARN, "the motion is no part of the task", values
    return OK, belief.likely_state, values


def _fixture(state: FixtureState | None) -> _Told:
    if state is None:
        return STALE, "no fixture controller", {}
    values = {
        "state": state.state,
        "factor": f"{state.factor:.3f}",
        "compliance": f"{state.compliance:.3f}",
    }
    return OK if state.reason in USUAL else WARN, state.reason, values


def _robot(state: RobotState | None) -> _Told:
    if state is None:
        return STALE, "no robot", {}
    values = {"limited": ", ".join(state.limited), "contacts": ", ".join(state.contacts)}
    if state.region_distance_m is not None:
        values["region_distance_m"] = f"{state.region_distance_m:.4f}"
    said = "following" if state.stop == "none" else state.stop
    return OK if state.stop in QUIET else ERROR, said, values


def _status(name: str, level: bytes, message: str, values: dict[str, str]) -> Fields:
    pairs = [{"key": key, "value": value} for key, value in values.items()]
    return {"level": level, "name": name, "message": message, "values": pairs}
