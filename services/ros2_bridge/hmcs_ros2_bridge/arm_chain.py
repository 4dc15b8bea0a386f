"""The joints between base and tool of a ROS robot, by its URDF."""

from __future__ import annotations

from pathlib import Path

from hmcs.arms.chain import Chain, chain_of
from hmcs.arms.tools import check_joints, only_tool_link
from hmcs.arms.urdf import Urdf, read_urdf
from hmcs.task import RobotSetup
from hmcs_ros2_bridge.robot_settings import RosRobotSettings


def urdf_named(settings: RosRobotSettings, robot: RobotSetup) -> Urdf | None:
    """Return the URDF that the settings, else the task file name; None where neither does.

    Raises UrdfError, with lines, for a file that describes no arm.
    """
    file = settings.urdf or (Path(robot.urdf) if robot.urdf else None)
    return read_urdf(file) if file is not None else None


def chain_in(urdf: Urdf, settings: RosRobotSettings, robot: RobotSetup) -> Chain:
    """Return the arm of a URDF as settings and task have it.

    Raises UrdfError where no link or several may be the tool, and where joints are commanded and
    the arm has too few for every direction.
    """
    tool_link = settings.tool_link or robot.tool_link or only_tool_link(urdf)
    framed = settings.base_frame if settings.base_frame in urdf.links else None
    base_link = robot.base_link or framed
    chain = chain_of(urdf, tool_link, base_link, robot.tool_offset_m)
    if settings.commands_joints:
        check_joints(urdf, chain, tool_link, base_link)
    return chain
