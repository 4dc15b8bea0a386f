"""The arms that can be simulated: those that come along, and one's own, described by a URDF."""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from hmcs.errors import UserError
from hmcs.task import RobotSetup
from hmcs.task.robots import brought_robots

JointPositions = tuple[float, ...] | Mapping[str, float]
"""rad, or m of a prismatic joint: of all joints in their order, or by joint."""


class RobotModel(NamedTuple):
    """One arm as its URDF describes it, and what the URDF does not say."""

    urdf: Path
    tool_link: str | None
    """The link whose frame, shifted by `tool_offset_m` along its z, is the tool frame; None where
    there is only one that may be."""
    tool_offset_m: float = 0.0
    home: JointPositions | None = None
    """Where the search for the first pose begins: comfortable, with the tool along +x; None where
    it is to be found."""
    joint_speed_rad_s: tuple[float, ...] | None = None
    """Largest joint speeds where those of the URDF are not the maker's."""
    base_link: str | None = None
    """The link whose frame is the base frame; None for the root."""
    package_path: tuple[Path, ...] = ()
    """Folders that hold the packages of `package://` names."""
    poses: Mapping[str, JointPositions] = {}
    """Postures with names."""


def _public() -> Path:
    """Return the folder of the descriptions that come with PyBullet, whether it is there or not."""
    # Importing it is not needed, and PyBullet is not there on every Python.
    found = find_spec("pybullet_data")
    return (
        Path(found.origin).parent if found is not None and found.origin else Path("pybullet_data")
    )


_ASSETS, _PUBLIC = Path(__file__).parent / "assets", _public()

_KNOWN: dict[str, RobotModel] = {
    "puma560": RobotModel(
        urdf=_ASSETS / "puma560.urdf",
        tool_link="tool",
        tool_offset_m=0.0,
        home=(0.36, 0.64, -3.6, 0.37, 1.4, 0.0),
        joint_speed_rad_s=None,
    ),
    # KUKA LBR iiwa 14 R820, data sheet: 85, 85, 100, 75, 130, 135, 135 °/s.
    "iiwa": RobotModel(
        urdf=_PUBLIC / "kuka_iiwa" / "model.urdf",
        tool_link="lbr_iiwa_link_7",
        tool_offset_m=0.045,
        home=(0.77, 0.74, -1.05, -1.88, -0.15, -0.83, 0.73),
        joint_speed_rad_s=(1.48, 1.48, 1.74, 1.30, 2.26, 2.35, 2.35),
    ),
    "panda": RobotModel(
        urdf=_PUBLIC / "franka_panda" / "panda.urdf",
        tool_link="panda_grasptarget",
        tool_offset_m=0.0,
        home=(1.43, -1.08, -0.99, -2.25, -1.39, 2.07, -1.53),
        joint_speed_rad_s=None,
    ),
}
ROBOTS = {name: model for name, model in _KNOWN.items() if model.urdf.is_file()}
"""The robots whose descriptions are there, by the name a task file gives them."""


def robot_named(name: str) -> RobotModel:
    """Return the robot of that name, which comes along or which another distribution brings.

    Raises UserError where its description, which comes with PyBullet, is not installed.
    """
    for robots in (ROBOTS, *brought_robots()):
        if name in robots:
            model: RobotModel = robots[name]
            return model
    raise UserError(
        f"robot {name}: its description comes with PyBullet, which has wheels for CPython 3.11 "
        f"alone and is not installed: choose {' or '.join(ROBOTS)}, or run on CPython 3.11"
    )


def model_of(setup: RobotSetup) -> RobotModel:
    """Return the arm of a task, whose file is read by `load_task`; raises as `robot_named`."""
    if setup.urdf is None:
        return robot_named(setup.model or "")
    return RobotModel(
        urdf=Path(setup.urdf),
        tool_link=setup.tool_link,
        tool_offset_m=setup.tool_offset_m,
        home=setup.home,
        base_link=setup.base_link,
        package_path=(*map(Path, setup.package_path), *ros_package_path()),
        poses=setup.poses,
    )


def ros_package_path() -> tuple[Path, ...]:
    """Return the folders where ROS would look for packages."""
    named = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
    shares = [
        str(Path(prefix) / "share")
        for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
        if prefix
    ]
    return tuple(Path(folder) for folder in (*named, *shares) if folder)
