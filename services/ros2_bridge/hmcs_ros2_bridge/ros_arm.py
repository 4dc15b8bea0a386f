"""The arm behind a ROS controller: its reports, and the commands to it."""

from __future__ import annotations

import importlib
import logging
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hmcs.arms.fence import Fence
from hmcs.arms.limits import ToolLimits
from hmcs.arms.urdf import Urdf, told, urdf_in
from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.task import Task
from hmcs_ros2_bridge.arm_chain import chain_in, urdf_named
from hmcs_ros2_bridge.arm_state import ArmReports
from hmcs_ros2_bridge.leading import MESSAGES, Leading, Led, TwistLeading, joint_leading_of
from hmcs_ros2_bridge.robot_settings import RosRobotSettings
from hmcs_ros2_bridge.ros import Node, Topic

_LONGEST_STEP_S = 0.1
"""After a longer time the arm is led on as if it had been so long."""
_NS_PER_S = 1_000_000_000
TF = Topic("/tf", "tf2_msgs/TFMessage", "reliable")
TF_STATIC = Topic("/tf_static", "tf2_msgs/TFMessage", "latched")
_NO_TF = (
    "tool_pose_from is tf, and transforms cannot be read ({reason}): there is no wheel of "
    "tf2_msgs. Use the Python of an installed ROS 2 after `source "
    "/opt/ros/DISTRIBUTION/setup.bash`, or choose --tool-pose-from joints or topic"
)
_SILENT = Led(np.zeros(6), (), None)


class RosArm:
    """An arm led by one topic; its reports are taken in on the thread of the node."""

    def __init__(
        self,
        settings: RosRobotSettings,
        task: Task,
        limits: ToolLimits,
        fence: Fence,
        log: logging.Logger,
    ) -> None:
        """Join ROS.

        Raises UserError where there is no ROS, and for a URDF of no such arm, with its lines.
        """
        self._settings, self._task, self._log = settings, task, log
        self._limits, self._fence = limits, fence
        by_joints = settings.pose_from == "joints"
        self.reports = ArmReports(
            settings.base_frame, by_joints=by_joints, tool_frame=settings.tool_link
        )
        topic = settings.robot_description_topic
        self._no_chain = (
            f"nothing was heard on {topic}: give --urdf, or start a robot_state_publisher"
            if by_joints
            else ""
        )
        self._leading: Leading | None = (
            None if settings.commands_joints else TwistLeading(limits, fence, settings.base_frame)
        )
        urdf = urdf_named(settings, task.robot) if by_joints else None
        if urdf is not None:
            self._learn(urdf)
        self.led = _SILENT
        """The last command."""
        self._led_ns = time.monotonic_ns()
        if settings.pose_from == "tf":
            check_transforms()
        self._node = Node(settings.node, settings.ros_args)
        self._commands = self._node.publisher(
            Topic(settings.commanded_topic, MESSAGES[settings.command], "reliable")
        )

    def start(
        self, soon: Callable[[Callable[[], None]], None], on_report: Callable[[], None]
    ) -> None:
        """Listen from now on; `soon` has `on_report` done in the loop after reports of the tool."""
        settings, node = self._settings, self._node

        def report(take: Callable[[Any, int], bool], message: Any) -> None:
            # On the thread of the node. The newest alone waits for its turn in the loop.
            if take(message, time.monotonic_ns()):
                soon(handle)

        def handle() -> None:
            self.reports.handled()
            on_report()

        def description(message: Any) -> None:
            self.reports.take_description(message)
            soon(self._read_description)

        if settings.pose_from == "topic":
            pose = Topic(settings.tool_pose_topic, "geometry_msgs/PoseStamped", "sensor")
            node.subscribe(pose, partial(report, self.reports.take_pose))
        elif settings.pose_from == "tf":
            take = self.reports.take_transforms
            node.subscribe(TF, partial(report, partial(take, stay=False)))
            node.subscribe(TF_STATIC, partial(report, partial(take, stay=True)))
        joints = Topic(settings.joint_states_topic, "sensor_msgs/JointState", "sensor")
        node.subscribe(joints, partial(report, self.reports.take_joints))
        looks = Topic(settings.robot_description_topic, "std_msgs/String", "latched")
        node.subscribe(looks, description)
        node.start()

    def move(self, velocity: Array, now_ns: int) -> None:
        """Have the tool go on at a velocity, m/s and rad/s, shape (6,), within its limits."""
        arm, leading = self.reports.newest, self._leading
        if arm is None or leading is None:
            self.stand(now_ns)
            return
        elapsed_s = min((now_ns - self._led_ns) / _NS_PER_S, _LONGEST_STEP_S)
        self._tell(leading.led(velocity, arm, elapsed_s, self._node.now_ns()), now_ns)

    def stand(self, now_ns: int) -> None:
        """Have the arm stand."""
        if self._leading is not None:
            self._tell(self._leading.standing(now_ns, self._node.now_ns()), now_ns)

    def trouble_at(self, now_ns: int) -> str:
        """Return why the arm cannot be led; empty where it can."""
        if self._no_chain:
            return self._no_chain
        age_s = self.reports.age_s(now_ns)
        if age_s is None or age_s * 1000.0 > self._settings.silent_after_ms:
            said = self.reports.refusal or "the robot is silent"
            return f"{said}: expected {self._expected}"
        return ""

    def others(self) -> int:
        """Return how many other publishers its commands have."""
        return self._commands.others()

    def close(self) -> None:
        """Bring the arm to a stand and leave ROS."""
        self.stand(time.monotonic_ns())
        self._node.close()

    @property
    def _expected(self) -> str:
        if self._settings.pose_from == "joints":
            return f"a JointState of its joints on {self._settings.joint_states_topic}"
        if self._settings.pose_from == "tf":
            return (
                f"transforms from {self._settings.base_frame} to {self._settings.tool_link} on "
                f"{TF.name} and {TF_STATIC.name}"
            )
        return f"a PoseStamped on {self._settings.tool_pose_topic}"

    def _tell(self, led: Led, now_ns: int) -> None:
        self.led, self._led_ns = led, now_ns
        if led.message is not None:
            self._commands.put(led.message)

    def _read_description(self) -> None:
        """Learn the arm's joints where nothing else has named them."""
        if not self._no_chain:
            return
        topic = Path(self._settings.robot_description_topic)
        try:
            self._learn(urdf_in(topic, self.reports.urdf.encode()))
        except UserError as error:
            self._no_chain = str(error)

    def _learn(self, urdf: Urdf) -> None:
        settings = self._settings
        chain = chain_in(urdf, settings, self._task.robot)
        if settings.commands_joints:
            self._leading = joint_leading_of(settings, self._limits, self._fence, chain)
        self.reports.chain, self._no_chain = chain, ""
        if chain.assumed:
            self._log.warning(told(urdf.file, chain.assumed))


def check_transforms() -> None:
    """Raise UserError where transforms of ROS cannot be read here."""
    try:
        importlib.import_module("tf2_msgs.msg")
    except ImportError as error:
        raise UserError(_NO_TF.format(reason=error)) from error
