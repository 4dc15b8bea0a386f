"""Where the links of a URDF are; `yourdfpy` is the oracle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yourdfpy

from hmcs.errors import UserError
from hmcs.motion.forward_kinematics import poses, read_chain
from hmcs.motion.quaternions import rotation_matrix

PUMA = Path(__file__).parents[3] / "services/robot/hmcs_robot/assets/puma560.urdf"
ARM = """<robot name="odd">
  <link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
  <link name="e"/>
  <joint name="turn" type="continuous"><parent link="base"/><child link="a"/>
    <origin xyz="0.1 -0.2 0.3" rpy="0.3 -0.7 1.1"/><axis xyz="0 3 4"/></joint>
  <joint name="slide" type="prismatic"><parent link="a"/><child link="b"/>
    <origin rpy="1 0 0"/><axis xyz="0 0.6 0.8"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <joint name="same" type="revolute"><parent link="b"/><child link="c"/>
    <origin xyz="0 0 0.2"/><axis xyz="1 0 0"/><mimic joint="turn" multiplier="-0.5" offset="0.2"/>
    <limit lower="-9" upper="9" effort="1" velocity="1"/></joint>
  <joint name="fix" type="fixed"><parent link="c"/><child link="d"/>
    <origin xyz="0.05 0 0" rpy="0 0 0.4"/></joint>
  <joint name="finger" type="revolute"><parent link="c"/><child link="e"/>
    <limit lower="-9" upper="9" effort="1" velocity="1"/></joint>
</robot>
"""


@pytest.fixture
def odd(tmp_path: Path) -> Path:
    file = tmp_path / "odd.urdf"
    file.write_text(ARM)
    return file


@pytest.mark.parametrize("link", ["d", "e", "tool"])
def test_every_pose_is_that_of_another_library(link: str, odd: Path) -> None:
    file = PUMA if link == "tool" else odd
    oracle = yourdfpy.URDF.load(str(file), load_meshes=False, build_scene_graph=True)
    end = list(oracle.link_map)[-1] if link == "tool" else link
    chain = read_chain(file, end)
    names = list(oracle.actuated_joint_names)[::-1]
    given = np.random.default_rng(0).uniform(-1.5, 1.5, (20, len(names)))
    places, turns = poses(chain, names, given)
    for row, place, turn in zip(given, places, turns, strict=True):
        oracle.update_cfg(dict(zip(names, row.tolist(), strict=True)))
        expected = oracle.get_transform(end, oracle.base_link)
        np.testing.assert_allclose(place, expected[:3, 3], atol=1e-9)
        np.testing.assert_allclose(rotation_matrix(turn), expected[:3, :3], atol=1e-9)


def test_an_axis_is_a_direction_however_long(odd: Path) -> None:
    names, given = ["turn", "slide"], np.array([[0.3, 0.4]])
    expected = poses(read_chain(odd, "d"), names, given)
    odd.write_text(ARM.replace("0 0.6 0.8", "0 3 4").replace("0 3 4", "0 6 8", 1))
    for found, same in zip(poses(read_chain(odd, "d"), names, given), expected, strict=True):
        np.testing.assert_allclose(found, same, atol=1e-12)


def test_joints_that_follow_others_need_no_positions(odd: Path) -> None:
    chain = read_chain(odd, "d")
    assert chain.names == ("turn", "slide")
    assert chain.turning == {"turn"}
    with pytest.raises(UserError, match="needs the positions of slide"):
        poses(chain, ["turn"], np.zeros((3, 1)))


def test_the_tool_is_found_by_its_name_or_asked_for(odd: Path) -> None:
    with pytest.raises(UserError, match="--link; the chains end at d, e"):
        read_chain(odd)
    with pytest.raises(UserError, match="has no link 'hand'"):
        read_chain(odd, "hand")
    odd.write_text(ARM.replace('"d"', '"tool0"'))
    assert read_chain(odd).link == "tool0"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('type="prismatic"', 'type="floating"', "'slide' is 'floating'"),
        ("0 3 4", "0 0 0", "axis 0 0 0"),
        ("0 3 4", "0 3", "expected 3 finite"),
        ("0 3 4", "0 nan 4", "expected 3 finite"),
        ('<mimic joint="turn"', '<mimic joint="same"', "mimics 'same'"),
        ('<parent link="base"/>', '<parent link="d"/>', "hangs on itself"),
        ('<parent link="base"/>', "", "has no parent link"),
        ("<robot name", "<!DOCTYPE x><robot name", "document type"),
        ("<robot name", "<sdf/><robot name", "no XML"),
    ],
)
def test_what_is_no_chain_is_refused(old: str, new: str, said: str, odd: Path) -> None:
    odd.write_text(ARM.replace(old, new, 1))
    with pytest.raises(UserError) as caught:
        read_chain(odd, "d")
    assert str(odd) in str(caught.value)
    assert said in str(caught.value)
