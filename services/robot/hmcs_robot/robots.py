"""The arms that can be simulated, and where their descriptions are."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from hmcs.errors import UserError


class RobotModel(NamedTuple):
    """One arm as its URDF describes it, and what the URDF does not say."""

    urdf: Path
    tool_link: str
    """The link whose frame, shifted by `tool_offset_m` along its z, is the tool frame."""
    tool_offset_m: float
    home: tuple[float, ...]
    """rad; where the search for the first pose begins: comfortable, with the tool along +x."""
    joint_speed_rad_s: tuple[float, ...] | None
    """Largest joint speeds where those of the URDF are not the maker's."""


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
    """Return the robot of that name.

    Raises UserError where its description, which comes with PyBullet, is not installed.
    """
    if name not in ROBOTS:
        raise UserError(
            f"robot {name}: its description comes with PyBullet, which has wheels for CPython 3.11 "
            f"alone and is not installed: choose {' or '.join(ROBOTS)}, or run on CPython 3.11"
        )
    return ROBOTS[name]
