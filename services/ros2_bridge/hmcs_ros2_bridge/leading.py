"""Messages for a ROS controller that have its arm follow a velocity of the tool.

A TwistStamped leaves the joints to the controller. A JointTrajectory or joint velocities are made
here of the arm's URDF: by damped least squares, with each joint within its range and its speed, as
the robot of this project does it. What the arm says of itself is old by its delay, so all bounds
slow it down earlier, and the tool is not drawn to a reference as where the arm is known at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import NamedTuple, Protocol

import numpy as np

from hmcs.arms.chain import Chain
from hmcs.arms.control import Following, Standing, Tuning, follow
from hmcs.arms.fence import Fence
from hmcs.arms.limits import Limits, ToolLimits
from hmcs.arms.state import ArmState
from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs_ros2_bridge.arm_state import ArmReport
from hmcs_ros2_bridge.fields import Fields, header, stamp, twist
from hmcs_ros2_bridge.robot_settings import CommandKind, RosRobotSettings
from hmcs_ros2_bridge.tool_limits import admitted

UNDRAWN = Tuning(correction_per_s=0.0)
"""A late pose would draw the tool ahead of what is commanded."""
HELD_FOR_NS = 500_000_000
"""So long after a stop a trajectory holds the joints; then nothing is said: an arm that starts anew
somewhere else must not be moved back."""
_BEYOND_DELAY_RAD = 0.02
"""How far the joints that are commanded may be ahead of those that are reported, besides what the
delay explains; m of a prismatic joint."""
_NS_PER_S = 1_000_000_000
MESSAGES: dict[CommandKind, str] = {
    "twist": "geometry_msgs/TwistStamped",
    "joint_trajectory": "trajectory_msgs/JointTrajectory",
    "joint_velocity": "std_msgs/Float64MultiArray",
}


class Led(NamedTuple):
    """A command to the arm: the twist it stands for, and the message."""

    twist: Array
    """The velocity its tool follows after all limits, m/s and rad/s, shape (6,)."""
    names: tuple[str, ...]
    """Of the limits that shape it."""
    message: Fields | None
    """Of ROS; None where nothing is said."""


class Leading(Protocol):
    """Makes messages for a controller; time by this process' monotonic clock."""

    def led(self, velocity: Array, arm: ArmReport, elapsed_s: float, stamp_ns: int) -> Led:
        """Return what brings the tool on at `velocity`, shape (6,), `elapsed_s` after the last."""
        ...

    def standing(self, now_ns: int, stamp_ns: int) -> Led:
        """Return what has the arm stand."""
        ...


class TwistLeading:
    """By geometry_msgs/TwistStamped."""

    def __init__(self, limits: ToolLimits, fence: Fence, frame: str) -> None:
        self._limits, self._fence, self._frame = limits, fence, frame
        self._before = np.zeros(6)

    def led(self, velocity: Array, arm: ArmReport, elapsed_s: float, stamp_ns: int) -> Led:
        """Return the velocity within the limits of the tool."""
        limited = admitted(velocity, arm.pose, self._before, self._limits, self._fence, elapsed_s)
        return self._message(limited.twist, limited.names, stamp_ns)

    def standing(self, now_ns: int, stamp_ns: int) -> Led:
        """Return zeros."""
        return self._message(np.zeros(6), (), stamp_ns)

    def _message(self, velocity: Array, names: tuple[str, ...], stamp_ns: int) -> Led:
        self._before = velocity
        message = {"header": header(stamp_ns, self._frame), "twist": twist(velocity)}
        return Led(velocity, names, message)


class JointMotion(NamedTuple):
    """What the joints of an arm are to do."""

    velocities: Array
    """rad/s, or m/s, shape (n,)."""
    reference: Array
    """Where they should be by now, rad or m, shape (n,)."""


class JointSpeech(Protocol):
    """Puts a motion of the joints into a message of ROS."""

    def moving(self, motion: JointMotion) -> Fields:
        """Return what has the joints move."""
        ...

    def held(self, reference: Array | None, stopped_for_ns: int) -> Fields | None:
        """Return what has them stand; None where nothing is to be said."""
        ...


class JointLeading:
    """By joints: differential kinematics of an arm that reports them."""

    def __init__(
        self, chain: Chain, limits: ToolLimits, fence: Fence, delay_s: float, speech: JointSpeech
    ) -> None:
        self._chain, self._fence, self._speech = chain, fence, speech
        self._limits = Limits(joints=chain.limits, **asdict(limits))
        self._explained_s = 2.0 * delay_s
        self._lately = np.zeros(len(chain.joint_names))
        self._carried: Following | Standing = Standing()
        self._posture = self._reference = np.zeros(0)
        self._stopped_ns: int | None = None

    def led(self, velocity: Array, arm: ArmReport, elapsed_s: float, stamp_ns: int) -> Led:
        """Return the motion of the joints within their limits and those of the tool."""
        at = arm.joint_positions
        if isinstance(self._carried, Standing):
            self._posture = self._reference = at
            self._lately = np.zeros(len(at))
            self._stopped_ns = None
        state = ArmState(at, np.zeros_like(at), arm.pose, self._chain.jacobians(at), None, ())
        planes = self._fence.planes(arm.pose)
        command = follow(
            state,
            velocity,
            self._carried,
            self._posture,
            self._limits,
            UNDRAWN,
            elapsed_s,
            planes,
        )
        self._carried = command.carried
        velocities = command.joint_velocities
        self._lately = np.maximum(
            np.abs(velocities), self._lately * np.exp(-elapsed_s / self._explained_s)
        )
        self._reference = self._near(self._reference + velocities * elapsed_s, at)
        motion = JointMotion(velocities, self._reference)
        return Led(command.reference_twist, command.limited, self._speech.moving(motion))

    def standing(self, now_ns: int, stamp_ns: int) -> Led:
        """Return what has the joints stand where they are."""
        self._carried = Standing()
        if self._stopped_ns is None:
            self._stopped_ns = now_ns
        reference = self._reference if len(self._reference) else None
        message = self._speech.held(reference, now_ns - self._stopped_ns)
        return Led(np.zeros(6), (), message)

    def _near(self, reference: Array, at: Array) -> Array:
        """Return a reference within the ranges and not far from where the joints are, (n,)."""
        joints = self._chain.limits
        inside = np.clip(reference, np.minimum(joints.lower, at), np.maximum(joints.upper, at))
        # An arm that was held and is let go must not catch up faster than it was led.
        ahead = self._explained_s * self._lately + _BEYOND_DELAY_RAD
        return np.asarray(np.clip(inside, at - ahead, at + ahead))


class VelocitySpeech:
    """std_msgs/Float64MultiArray, as velocity controllers have it."""

    def __init__(self, chain: Chain, joints: Sequence[str] = ()) -> None:
        """`joints` are those of the chain in the order of the controller, by default its own.

        Raises UserError where they are others.
        """
        names = chain.joint_names
        if joints and sorted(joints) != sorted(names):
            raise UserError(
                f"joints are {', '.join(joints)}, expected those between base and tool, in the "
                f"controller's order: {', '.join(names)}"
            )
        self._order = [names.index(name) for name in joints or names]

    def moving(self, motion: JointMotion) -> Fields:
        """Return the velocities."""
        return {"data": motion.velocities[self._order].tolist()}

    def held(self, reference: Array | None, stopped_for_ns: int) -> Fields | None:
        """Return zeros, as often as asked: such a controller keeps its last velocities."""
        return {"data": [0.0] * len(self._order)}


class TrajectorySpeech:
    """trajectory_msgs/JointTrajectory of one point without velocities, which every controller
    takes, to be reached after `span_s`.
    """

    def __init__(self, chain: Chain, span_s: float) -> None:
        self._names = list(chain.joint_names)
        self._span_s = span_s

    def moving(self, motion: JointMotion) -> Fields:
        """Return where the joints are after the span."""
        return self._to(motion.reference + motion.velocities * self._span_s)

    def held(self, reference: Array | None, stopped_for_ns: int) -> Fields | None:
        """Return where they should be by now, for a while after a stop."""
        if reference is None or stopped_for_ns > HELD_FOR_NS:
            return None
        return self._to(reference)

    def _to(self, positions: Array) -> Fields:
        # A stamp of zero has it begin at once.
        return {
            "header": header(0, ""),
            "joint_names": self._names,
            "points": [
                {
                    "positions": positions.tolist(),
                    "time_from_start": stamp(round(self._span_s * _NS_PER_S)),
                }
            ],
        }


def joint_leading_of(
    settings: RosRobotSettings, limits: ToolLimits, fence: Fence, chain: Chain
) -> JointLeading:
    """Return what leads an arm by its joints; raises UserError for joints that are not its own."""
    speech: JointSpeech = (
        TrajectorySpeech(chain, settings.trajectory_s)
        if settings.command == "joint_trajectory"
        else VelocitySpeech(chain, settings.joints)
    )
    return JointLeading(chain, limits, fence, settings.delay_s, speech)
