"""A ROS 2 operator as a source of the input device: `hmcs_input_device --source ros2`.

What moves the hand is one topic; what enables it is the dead-man's button of a sensor_msgs/Joy,
always. The input device applies its own rules on top, the same for every device: whether a press
counts, what no hand does, steps after the dead zone.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from hmcs.arrays import Array
from hmcs.errors import UserError, first_problem
from hmcs.motion.admittance import Admittance
from hmcs.motion.device_sample import LIVE, DeviceSample
from hmcs.task import Task
from hmcs_ros2_bridge.fields import (
    NonsenseError,
    check_frame,
    pose_in,
    twist_in,
    wrench_in,
)
from hmcs_ros2_bridge.hand import (
    Hand,
    Switches,
    moved_by,
    stick_in,
    switches_in,
    velocity_between,
)
from hmcs_ros2_bridge.ros import Node, Topic

RATE_HZ = 100.0
MotionKind = Literal["twist", "pose", "joy", "wrench"]
_KINDS: dict[MotionKind, str] = {
    "twist": "geometry_msgs/TwistStamped",
    "pose": "geometry_msgs/PoseStamped",
    "joy": "sensor_msgs/Joy",
    "wrench": "geometry_msgs/WrenchStamped",
}


class OperatorOptions(BaseModel):
    """The setting `options` of the input device, for the source `ros2`."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True
    )

    motion: MotionKind = "twist"
    """What moves the hand: `twist` (TwistStamped), `pose` (PoseStamped), `joy` (axes of the Joy),
    `wrench` (WrenchStamped, the operator's force without the tool's weight, through the task's
    admittance)."""
    motion_topic: str = "operator"
    """Where that comes from; not of `joy`."""
    joy_topic: str = "joy"
    """Where the buttons come from."""
    dead_man_button: int = Field(default=4, ge=0)
    """Index in the Joy's buttons; held, it lets the hand move."""
    clutch_button: int | None = Field(default=5, ge=0)
    """Held, it lets the device be moved without the hand."""
    pedal_button: int | None = Field(default=0, ge=0)
    """Marks where another part of the task begins."""
    axes: tuple[int | None, int | None, int | None] = (1, 0, 4)
    """Of `joy`: index of the axis for forward, left and up."""
    scale_m_s: float = Field(default=0.15, gt=0.0, le=0.5)
    """Of `joy`: speed of the hand at full deflection."""
    dead_band: float = Field(default=0.1, ge=0.0, le=0.9)
    """Of `joy`: share of the deflection up to which an axis counts as let go of."""
    frames: tuple[str, ...] = ("base_link", "base", "")
    """Frames in which motion is taken; how they are turned is the setting task_frame_xyzw."""
    node: str = "hmcs_operator"
    """Name of the ROS node."""
    ros_args: tuple[str, ...] = ()
    """As after --ros-args, e.g. -r operator:=/spacenav/twist."""


class _HasOptions(Protocol):
    @property
    def options(self) -> dict[str, Any]: ...


class Heard(NamedTuple):
    """The newest message of a topic."""

    message: Any
    """Of ROS, or the NonsenseError that it was."""
    heard_s: float
    """Arrival by this process' monotonic clock; a clock of the sender is not looked at."""


class RosOperator:
    """The hand of a ROS operator; its messages are taken on the thread of the node."""

    rate_hz = RATE_HZ
    duration_s = LIVE
    reach_m = None

    def __init__(
        self,
        options: OperatorOptions,
        admittance: Admittance,
        node: Node,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._options, self._admittance = options, admittance
        self._node, self._clock = node, clock
        self._heard: dict[str, Heard] = {}
        self._released = False
        self._hand = Hand()
        self._placed: tuple[Any, Array] | None = None
        self._asked_s = clock()
        self._trouble = ""
        node.subscribe(Topic(options.joy_topic, "sensor_msgs/Joy", "sensor"), self._on_joy)
        if options.motion != "joy":
            topic = Topic(options.motion_topic, _KINDS[options.motion], "sensor")
            node.subscribe(topic, lambda message: self._take("motion", message))
        node.start()

    @property
    def trouble(self) -> str:
        """Why nothing moves, and what to do; empty while all is well."""
        return self._trouble

    def sample(self, elapsed_s: float | None) -> DeviceSample:
        """Return the hand now."""
        now_s = self._clock()
        since_s, self._asked_s = now_s - self._asked_s, now_s
        released, self._released = self._released, False
        needed = {self._options.joy_topic: self._heard.get("joy")}
        if self._options.motion != "joy":
            needed[self._options.motion_topic] = self._heard.get("motion")
        missing = [topic for topic, heard in needed.items() if heard is None]
        if missing:
            return self._resting(f"nothing was heard yet on {' and '.join(missing)}: start it")
        heard = [each for each in needed.values() if each is not None]
        try:
            # Let go of and pressed anew between two samples, it was let go of all the same.
            switches = self._switches(heard[0].message)._replace(
                **({"dead_man": False} if released else {})
            )
            sample = self._moved(heard[-1].message, switches, since_s)
        except NonsenseError as error:
            return self._resting(f"the ROS operator {error}: mend its node or the options")
        self._trouble = ""
        return sample._replace(age_s=now_s - min(each.heard_s for each in heard))

    def close(self) -> None:
        """Leave ROS."""
        self._node.close()

    def _on_joy(self, message: Any) -> None:
        index = self._options.dead_man_button
        if index < len(message.buttons) and not message.buttons[index]:
            self._released = True
        self._take("joy", message)

    def _take(self, what: str, message: Any) -> None:
        self._heard[what] = Heard(message, self._clock())

    def _resting(self, trouble: str) -> DeviceSample:
        self._trouble, self._placed = trouble, None
        self._hand = Hand(self._hand.position)
        return DeviceSample(self._hand.position, np.zeros(3), dead_man=False)

    def _switches(self, joy: Any) -> Switches:
        options = self._options
        indices = (options.dead_man_button, options.clutch_button, options.pedal_button)
        return switches_in(joy, indices)

    def _moved(self, message: Any, switches: Switches, since_s: float) -> DeviceSample:
        if self._options.motion == "pose":
            return self._placed_hand(message, switches)
        wrench = None
        if self._options.motion == "joy":
            stick = stick_in(message, self._options.axes, self._options.dead_band)
            twist = np.concatenate([self._options.scale_m_s * stick, np.zeros(3)])
        elif self._options.motion == "twist":
            check_frame(message, self._options.frames)
            twist = twist_in(message.twist)
        else:
            check_frame(message, self._options.frames)
            wrench = wrench_in(message.wrench)
            twist = self._admittance.twist(wrench)
        self._hand = moved_by(self._hand, twist, since_s, switches)
        turning = None if self._options.motion == "joy" else self._hand.twist[3:]
        return DeviceSample(
            self._hand.position,
            self._hand.twist[:3],
            *switches,
            angular_velocity=turning,
            wrench=wrench,
        )

    def _placed_hand(self, message: Any, switches: Switches) -> DeviceSample:
        check_frame(message, self._options.frames)
        position, orientation = pose_in(message.pose)
        velocity = self._velocity(message, position)
        self._hand = Hand(position, np.concatenate([velocity, np.zeros(3)]))
        return DeviceSample(position, velocity, *switches, orientation=orientation)

    def _velocity(self, message: Any, position: Array) -> Array:
        """Of the hand between its last two messages, by the sender's clock alone."""
        before, self._placed = self._placed, (message, position)
        if before is None:
            return np.zeros(3)
        if before[0] is message:
            self._placed = before
            return self._hand.twist[:3]
        elapsed_s = _seconds(message) - _seconds(before[0])
        return velocity_between(before[1], position, elapsed_s)


def open_source(settings: _HasOptions, task: Task) -> RosOperator:
    """Return the ROS operator of a task, as the setting `options` describes it.

    Raises UserError where the options are wrong or there is no ROS 2.
    """
    try:
        options = OperatorOptions.model_validate(settings.options)
    except ValidationError as error:
        where, why = first_problem(error)
        raise UserError(f"options.{where}: {why}") from None
    set_up = task.robot.cooperation
    admittance = Admittance(
        set_up.force_threshold_n,
        set_up.torque_threshold_n_m,
        set_up.m_s_per_n,
        set_up.rad_s_per_n_m,
    )
    return RosOperator(options, admittance, Node(options.node, options.ros_args))


def _seconds(message: Any) -> float:
    stamp = message.header.stamp
    return float(stamp.sec + stamp.nanosec * 1e-9)
