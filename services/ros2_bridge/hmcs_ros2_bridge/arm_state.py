"""What a ROS robot says of itself, kept as the newest of each kind."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hmcs.arms.chain import Chain, pose_of
from hmcs.arms.state import Pose
from hmcs.arrays import Array
from hmcs.motion.quaternions import between
from hmcs_ros2_bridge.fields import NonsenseError, check_frame, pose_in
from hmcs_ros2_bridge.frames import Frames

MOST_JOINTS = 64
LONGEST_URDF = 1_000_000
"""Letters of a description that are kept."""
_LONGEST_GAP_S = 0.5
"""A velocity over a longer time says nothing of now."""


class ArmReport(NamedTuple):
    """The tool at one moment, base frame."""

    pose: Pose
    twist: Array
    """m/s and rad/s, shape (6,), over the time since the report before, by the arm's own clock."""
    stamp_s: float
    """By the arm's own clock."""
    heard_ns: int
    """Arrival by this process' monotonic clock."""
    joint_positions: Array
    """Of the arm's chain, rad or m, shape (n,), where the pose was made of them; else (0,)."""


class Joints(NamedTuple):
    """The joints at one moment."""

    names: tuple[str, ...]
    positions: Array
    """rad, or m of prismatic joints, shape (n,)."""
    velocities: Array
    """The same per second; zero where the robot does not say."""


def joints_in(message: Any) -> Joints:
    """Return a sensor_msgs/JointState; raises NonsenseError for one that does not fit itself."""
    names = tuple(message.name)
    positions = np.array(message.position, dtype=float)
    velocities = np.array(message.velocity, dtype=float)
    if not len(velocities):
        velocities = np.zeros(len(positions))
    if not len(names) == len(positions) == len(velocities) <= MOST_JOINTS:
        raise NonsenseError(
            f"has {len(names)} joints, {len(positions)} positions, {len(velocities)} velocities"
        )
    if not (np.isfinite(positions).all() and np.isfinite(velocities).all()):
        raise NonsenseError("has joints that are not finite")
    return Joints(names, positions, velocities)


def report_of(message: Any, heard_ns: int, before: ArmReport | None, frame: str) -> ArmReport:
    """Return a geometry_msgs/PoseStamped of the tool as a report after another one.

    Raises NonsenseError where it is in another frame, or cannot be.
    """
    check_frame(message, (frame,))
    pose = Pose(*pose_in(message.pose))
    return _after(before, pose, stamp_s_of(message), heard_ns, np.zeros(0))


def report_of_frame(
    frames: Frames, tool: str, heard_ns: int, before: ArmReport | None, base: str
) -> ArmReport | None:
    """Return where transforms have the tool; None where they say nothing new of it."""
    found = frames.pose(tool, base)
    if found is None or (before is not None and found[1] <= before.stamp_s):
        return None
    return _after(before, *found, heard_ns, np.zeros(0))


def report_of_joints(
    message: Any, joints: Joints, heard_ns: int, before: ArmReport | None, chain: Chain
) -> ArmReport:
    """Return where the tool is at joints of a sensor_msgs/JointState, by forward kinematics.

    Raises NonsenseError where one of the chain's joints is not among them.
    """
    missing = [name for name in chain.joint_names if name not in joints.names]
    if missing:
        raise NonsenseError(f"tells no position of {', '.join(missing)[:200]}")
    positions = joints.positions[[joints.names.index(name) for name in chain.joint_names]]
    pose = pose_of(chain.poses(positions))
    return _after(before, pose, stamp_s_of(message), heard_ns, positions)


def stamp_s_of(message: Any) -> float:
    """Return the stamp of a message with a header, s."""
    return float(message.header.stamp.sec + message.header.stamp.nanosec * 1e-9)


def _after(
    before: ArmReport | None, pose: Pose, stamp_s: float, heard_ns: int, joint_positions: Array
) -> ArmReport:
    moving = np.zeros(6)
    if before is not None and 0.0 < stamp_s - before.stamp_s <= _LONGEST_GAP_S:
        turn = between(before.pose.orientation, pose.orientation)
        moved = np.concatenate([pose.position - before.pose.position, turn])
        moving = moved / (stamp_s - before.stamp_s)
    return ArmReport(pose, moving, stamp_s, heard_ns, joint_positions)


class ArmReports:
    """The newest reports of an arm; taken on ROS' thread, read in the loop."""

    def __init__(self, frame: str, *, by_joints: bool = False, tool_frame: str = "") -> None:
        """`by_joints`: the tool is where the joints put it, once the `chain` is known; `tool_frame`
        is looked for in transforms.
        """
        self._frame, self._tool_frame = frame, tool_frame
        self._frames = Frames()
        self._by_joints = by_joints
        self._waiting = False
        self.chain: Chain | None = None
        """The joints between base and tool; None until they are known."""
        self.newest: ArmReport | None = None
        """Of the tool."""
        self.joints = Joints((), np.zeros(0), np.zeros(0))
        self.urdf = ""
        self.refused = 0
        """Reports that could not be used."""
        self.refusal = ""
        """Why the last one could not; empty after one that could."""

    def take_pose(self, message: Any, heard_ns: int) -> bool:
        """Take in a report of the tool; return whether it is to be handled, see `handled`."""
        try:
            self.newest = report_of(message, heard_ns, self.newest, self._frame)
        except NonsenseError as error:
            self._refuse(f"the tool's pose {error}")
            return False
        return self._to_be_handled()

    def handled(self) -> None:
        """Note that the newest report was handled."""
        self._waiting = False

    def take_joints(self, message: Any, heard_ns: int) -> bool:
        """Take in the joints; return whether they are a report of the tool to be handled.

        Where the tool is made of them, messages without any joint of the arm are those of others.
        """
        try:
            joints = joints_in(message)
            if not self._by_joints:
                self.joints = joints
                return False
            if self.chain is None or not set(joints.names) & set(self.chain.joint_names):
                return False
            report = report_of_joints(message, joints, heard_ns, self.newest, self.chain)
        except NonsenseError as error:
            self._refuse(f"the robot {error}")
            return False
        self.joints, self.newest = joints, report
        return self._to_be_handled()

    def take_transforms(self, message: Any, heard_ns: int, *, stay: bool) -> bool:
        """Take in transforms; return whether they say where the tool is, to be handled."""
        try:
            self._frames.take(message, stays=stay)
        except NonsenseError as error:
            self._refuse(f"a transform {error}")
            return False
        tool, before = self._tool_frame, self.newest
        report = report_of_frame(self._frames, tool, heard_ns, before, self._frame)
        if report is None:
            return False
        self.newest = report
        return self._to_be_handled()

    def take_description(self, message: Any) -> None:
        """Take in how the robot looks."""
        if len(message.data) <= LONGEST_URDF:
            self.urdf = message.data

    def age_s(self, now_ns: int) -> float | None:
        """Return how long ago the tool was heard of; None where it never was."""
        return None if self.newest is None else (now_ns - self.newest.heard_ns) / 1e9

    def _to_be_handled(self) -> bool:
        self.refusal = ""
        waiting, self._waiting = self._waiting, True
        return not waiting

    def _refuse(self, reason: str) -> None:
        self.refused += 1
        self.refusal = reason
