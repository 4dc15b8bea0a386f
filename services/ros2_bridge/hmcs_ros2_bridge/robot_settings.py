"""Settings of the robot whose arm a ROS 2 controller moves."""

from __future__ import annotations

from pydantic import Field

from hmcs.bus.settings import ServiceSettings


class RosRobotSettings(ServiceSettings):
    """Settings of a robot that follows by way of ROS 2."""

    task: str = "human-shapes"
    """Name of a task that comes along, or path of a task file: workspace, regions, speed limits."""
    command_topic: str = "/servo_node/delta_twist_cmds"
    """TwistStamped, for MoveIt Servo or a cartesian controller; nobody else may publish there."""
    tool_pose_topic: str = "/tool_pose"
    """PoseStamped of the tool, in `base_frame`."""
    joint_states_topic: str = "/joint_states"
    """JointState of the arm."""
    robot_description_topic: str = "/robot_description"
    """String with the URDF, as robot_state_publisher latches it: what the page draws."""
    base_frame: str = Field(default="base_link", min_length=1)
    """Of the robot in ROS: commands are given and poses expected in it."""
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
    """From a command to the motion that the robot reports: the longer, the earlier the tool slows
    down before walls and regions."""
    acceleration_limit_m_s2: float = Field(default=2.0, gt=0.0)
    """Of the commanded tool; a stop is not held back by it."""
    angular_acceleration_limit_rad_s2: float = Field(default=10.0, gt=0.0)
    node: str = "hmcs_robot"
    """Name of the ROS node."""
    ros_args: tuple[str, ...] = ()
    """As after --ros-args, e.g. -r /tool_pose:=/franka/pose."""
