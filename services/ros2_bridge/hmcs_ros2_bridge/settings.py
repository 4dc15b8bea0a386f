"""Settings of what ROS 2 watches."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from hmcs.bus.settings import ServiceSettings


class Ros2BridgeSettings(ServiceSettings):
    """Settings of the bridge by which ROS 2 watches a cell."""

    task: str = "human-shapes"
    """Name of a task that comes along, or path of a task file: workspace and regions to show."""
    models: tuple[Path, ...] = ()
    """Model files whose learned paths are shown as guides; of a folder, the one named as `task`."""
    base_frame: str = Field(default="base_link", min_length=1)
    """The robot's base in ROS."""
    operator_frame: str = Field(default="operator", min_length=1)
    """The operator's frame in ROS."""
    poses_rate_hz: float = Field(default=100.0, gt=0.0, le=1000.0)
    """At most so many poses and joint states a second."""
    scene_every_s: float = Field(default=0.2, gt=0.0, le=10.0)
    """How often the guide and the direction are shown."""
    diagnostics_every_s: float = Field(default=1.0, gt=0.0, le=10.0)
    """How often diagnostics are published; what is older than this is not shown."""
    node: str = "hmcs"
    """Name of the ROS node; its topics are /hmcs/…."""
    ros_args: tuple[str, ...] = ()
    """As after --ros-args, e.g. -r /hmcs/joint_states:=/joint_states."""
