"""What an arm tells those who draw it, and where its meshes are looked for."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from hmcs.arms.urdf import read_urdf
from hmcs_robot.arm_description import arm_description
from hmcs_robot.description.described import describe
from hmcs_robot.description.meshes import MeshFiles, unusable
from hmcs_robot.engine import Engine
from hmcs_robot.robots import ROBOTS


def test_every_mesh_of_an_arm_is_reported_and_every_joint_named(robot: str, arm: Engine) -> None:
    robot_description = arm_description(describe(ROBOTS[robot]))
    named = set(re.findall(r'filename="([^"]+)"', robot_description.urdf))
    assert named <= set(robot_description.files)
    assert len(robot_description.joints) == len(arm.joint_names)
    for joint in robot_description.joints:
        assert f'name="{joint}"' in robot_description.urdf


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A folder `my_arm` as ROS lays it out, with a mesh whose name has a blank."""
    folder = tmp_path / "my_arm"
    (folder / "urdf").mkdir(parents=True)
    (folder / "meshes").mkdir()
    (folder / "meshes" / "a link.stl").write_bytes(b"mesh")
    (folder / "meshes" / "link.step").write_bytes(b"mesh")
    return folder


def described(file: Path, attribute: str) -> Path:
    visual = f"<visual><geometry><mesh {attribute}/></geometry></visual>"
    file.write_text(f'<robot name="a">\n<link name="base">\n{visual}</link></robot>')
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
    file = described(package / "urdf" / "arm.urdf", f"filename = {quote}{name}{quote}")
    found = MeshFiles(file).find(name)
    assert found is not None
    assert found.read_bytes() == b"mesh"
    assert unusable(read_urdf(file), MeshFiles(file)) == ()


@pytest.mark.parametrize("on_path", [".", "my_arm"])
def test_a_package_elsewhere_is_found_on_the_search_path(
    package: Path, tmp_path: Path, on_path: str
) -> None:
    (tmp_path / "packages").mkdir()
    package.rename(tmp_path / "packages" / "my_arm")
    name = "package://my_arm/meshes/a link.stl"
    file = described(tmp_path / "arm.urdf", f'filename="{name}"')
    assert MeshFiles(file).find(name) is None
    assert MeshFiles(file, (tmp_path / "packages" / on_path,)).find(name) is not None


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("../meshes/none.stl", "no such file"),
        ("package://other/meshes/a link.stl", "package_path"),
        ("../meshes/link.step", r"\.step is read neither"),
    ],
)
def test_a_mesh_that_cannot_be_used_is_reported_with_its_line(
    package: Path, name: str, said: str
) -> None:
    file = described(package / "urdf" / "arm.urdf", f'filename="{name}"')
    (found,) = unusable(read_urdf(file), MeshFiles(file))
    assert found.line == 3
    assert name in found.message
    assert re.search(said, found.message)


def test_every_shipped_arm_can_be_drawn_whole(robot: str) -> None:
    assert describe(ROBOTS[robot]).notes == ()
