"""What an arm tells those who draw it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from hmcs.errors import UserError
from hmcs_robot.arm_description import arm_description, missing_meshes
from hmcs_robot.engine import Engine
from hmcs_robot.robots import ROBOTS


def test_every_mesh_of_an_arm_is_reported_and_every_joint_named(robot: str, arm: Engine) -> None:
    robot_description = arm_description(ROBOTS[robot].urdf, arm.joint_names)
    named = set(re.findall(r'filename="([^"]+)"', robot_description.urdf))
    assert named <= set(robot_description.files)
    assert (
        len(robot_description.joints) == len(arm.joint_names) == len(np.array(ROBOTS[robot].home))
    )
    for joint in robot_description.joints:
        assert f'name="{joint}"' in robot_description.urdf


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A folder `my_arm` as ROS lays it out, with a mesh whose name has a blank."""
    folder = tmp_path / "my_arm"
    (folder / "urdf").mkdir(parents=True)
    (folder / "meshes").mkdir()
    (folder / "meshes" / "a link.stl").write_bytes(b"mesh")
    return folder


def described(package: Path, attribute: str) -> Path:
    file = package / "urdf" / "arm.urdf"
    visual = f"<visual><geometry><mesh {attribute}/></geometry></visual>"
    file.write_text(f'<robot name="a"><link name="base">{visual}</link></robot>')
    return file


@pytest.mark.parametrize(
    "name",
    [
        "../meshes/a link.stl",
        "package://my_arm/meshes/a link.stl",
        "package://my_arm/meshes/a%20link.stl",
        "model://my_arm/meshes/a link.stl",
        "file://FOLDER/meshes/a%20link.stl",
        "FOLDER/meshes/a link.stl",
    ],
)
@pytest.mark.parametrize("quote", ["'", '"'])
def test_a_mesh_is_found_by_every_name_that_descriptions_give(
    package: Path, name: str, quote: str
) -> None:
    name = name.replace("FOLDER", str(package))
    file = described(package, f"filename = {quote}{name}{quote}")
    assert arm_description(file, ()).files == {name: b"mesh"}
    assert missing_meshes(file) == ()


@pytest.mark.parametrize("name", ["../meshes/none.stl", "package://other/meshes/a link.stl"])
def test_a_name_that_leads_to_no_file_is_reported(package: Path, name: str) -> None:
    file = described(package, f'filename="{name}"')
    assert arm_description(file, ()).files == {}
    assert missing_meshes(file) == (name,)


def test_a_description_that_is_no_xml_is_a_mistake_of_its_user(package: Path) -> None:
    file = package / "urdf" / "arm.urdf"
    file.write_text("robot")
    with pytest.raises(UserError, match="is no URDF"):
        arm_description(file, ())


def test_every_shipped_arm_can_be_drawn_whole(robot: str) -> None:
    assert missing_meshes(ROBOTS[robot].urdf) == ()
