"""Settings of the robot whose arm a ROS 2 controller moves."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, Self

from pydantic import Field, model_validator

from hmcs.bus.settings import ServiceSettings

CommandKind = Literal["twist", "joint_trajectory", "joint_velocity"]
COMMAND_TOPICS: dict[CommandKind, str] = {
    "twist": "/servo_node/delta_twist_cmds",
    "joint_trajectory": "/joint_trajectory_controller/joint_trajectory",
    "joint_velocity": "/forward_velocity_controller/commands",
}
"""Where the controllers of ROS listen unless they are set up otherwise."""


class RosRobotSettings(ServiceSettings):
    """Settings of a robot that follows by way of ROS 2."""

    task: str = "human-shapes"
    """Name of a task that comes along, or path of a task file: workspace, regions, speed limits."""
    command: CommandKind = "twist"
    """The messages to the arm: `twist` (TwistStamped, for MoveIt Servo or a cartesian controller),
    `joint_trajectory` (JointTrajectory of one point) or `joint_velocity` (Float64MultiArray), for
    which the arm's URDF is needed."""
    command_topic: str = ""
    """Nobody else may publish there. By default /servo_node/delta_twist_cmds,
    /joint_trajectory_controller/joint_trajectory or /forward_velocity_controller/commands."""
    joints: tuple[str, ...] = ()
    """Of `joint_velocity`: the joints in the order of the controller; by default from the base
    on."""
    trajectory_s: float = Field(default=0.05, gt=0.0, le=1.0)
    """Of `joint_trajectory`: each point is to be reached after so long. An arm that gets
    no more of them stands after it."""
    tool_pose_from: Literal["topic", "joints", "tf"] | None = None
    """Where the tool is: from `tool_pose_topic`, from the joints and the URDF, or from /tf and
    /tf_static, for which ROS' tf2_msgs is needed. By default from the topic, and from the joints
    where joints are commanded."""
    tool_pose_topic: str = "/tool_pose"
    """PoseStamped of the tool, in `base_frame`."""
    joint_states_topic: str = "/joint_states"
    """JointState of the arm."""
    robot_description_topic: str = "/robot_description"
    """String with the URDF, as robot_state_publisher latches it: what the page draws, and the arm's
    joints where neither `urdf` nor the task file names a URDF."""
    urdf: Path | None = None
    """The arm's URDF where it is neither the task's nor published."""
    tool_link: str = ""
    """Link of the URDF, or frame of /tf, that is the tool frame; by default the task's, or the only
    link that can be it."""
    base_frame: str = Field(default="base_link", min_length=1)
    """Of the robot in ROS: commands are given and poses expected in it. Where the URDF has a link
    of this name, joints count from it on."""
    silent_after_ms: float = Field(default=100.0, gt=0.0, le=1000.0)
    """A robot that says nothing of its tool for longer is stopped."""
    command_rate_hz: float = Field(default=100.0, ge=30.0, le=1000.0)
    """How often the command is repeated; while the robot stands, zeros."""
    command_valid_for_ms: float = Field(default=80.0, gt=0.0, le=1000.0)
    """No command counts longer after its arrival, whatever its sender says."""
    hang_s: float = Field(default=0.1, gt=0.0)
    """A longer silence of this process' own loop is its hang: the robot is stopped."""
    settle_s: float = Field(default=0.25, ge=0.0)
    """How long commands are refused after a hang, while what queued up meanwhile drains."""
    delay_s: float = Field(default=0.1, gt=0.0, le=1.0)
    """From a command to the motion that the robot reports: the longer, the earlier it slows down
    before walls, regions and the ends of its joints."""
    acceleration_limit_m_s2: float = Field(default=2.0, gt=0.0)
    """Of the commanded tool; a stop is not held back by it."""
    angular_acceleration_limit_rad_s2: float = Field(default=10.0, gt=0.0)
    node: str = "hmcs_robot"
    """Name of the ROS node."""
    ros_args: tuple[str, ...] = ()
    """As after --ros-args, e.g. -r /tool_pose:=/franka/pose."""

    @property
    def commanded_topic(self) -> str:
        """The topic of the commands."""
        return self.command_topic or COMMAND_TOPICS[self.command]

    @property
    def commands_joints(self) -> bool:
        """Whether the arm is commanded by its joints."""
        return self.command != "twist"

    @property
    def pose_from(self) -> str:
        """Where the tool's pose comes from."""
        return self.tool_pose_from or ("joints" if self.commands_joints else "topic")

    @model_validator(mode="after")
    def _joints_are_known(self) -> Self:
        if self.commands_joints and self.pose_from != "joints":
            raise ValueError(
                f"tool_pose_from is {self.tool_pose_from!r}, and a command of the kind "
                f"{self.command} needs joints: leave it out"
            )
        return self

    @model_validator(mode="after")
    def _tool_frame_is_named(self) -> Self:
        if self.pose_from == "tf" and not self.tool_link:
            raise ValueError("tool_pose_from is tf: name the tool's frame as tool_link")
        return self
