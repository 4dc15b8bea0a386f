"""An arm as MuJoCo has it, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from hmcs.errors import UserError
from hmcs.task import ForbiddenRegion, Obstacle
from hmcs_robot.engine import Cell
from hmcs_robot.robots import ROBOTS, RobotModel
from hmcs_robot_mujoco.engine import MujocoEngine
from hmcs_robot_mujoco.loading import loaded
from support.arms import needs

PERIOD_S = 1 / 240


@pytest.mark.parametrize("robot", sorted(ROBOTS))
def test_an_arm_stands_still_under_gravity_and_follows_velocities(robot: str) -> None:
    engine = MujocoEngine(Cell(ROBOTS[robot], (), ()), PERIOD_S, gui=False)
    begin, _ = engine.joints()
    still = np.zeros_like(begin)
    for _ in range(240):
        engine.step(still)
    np.testing.assert_allclose(engine.joints()[0], begin, atol=1e-9)
    slow = np.full_like(begin, 0.05)
    for _ in range(240):
        engine.step(slow)
    positions, velocities = engine.joints()
    np.testing.assert_allclose(velocities, slow, atol=1e-9)
    np.testing.assert_allclose(positions - begin, 0.05, atol=1e-3)
    engine.close()


@needs("panda")
def test_a_joint_that_is_no_part_of_the_way_to_the_tool_is_held() -> None:
    found = loaded(Cell(ROBOTS["panda"], (), ()), PERIOD_S)
    assert found.arm.chain.joint_names == tuple(f"panda_joint{k}" for k in range(1, 8))
    assert found.model.nv == 7


def test_weak_motors_let_the_arm_sink(tmp_path: Path) -> None:
    urdf = tmp_path / "weak.urdf"
    text = ROBOTS["puma560"].urdf.read_text(encoding="utf-8")
    urdf.write_text(text.replace('effort="186.4"', 'effort="1.0"'), encoding="utf-8")
    model = ROBOTS["puma560"]._replace(urdf=urdf)
    engine = MujocoEngine(Cell(model, (), ()), PERIOD_S, gui=False)
    height = engine.tool().position[2]
    for _ in range(60):
        engine.step(np.zeros(6))
    assert engine.tool().position[2] < height - 0.05


@needs("iiwa")
@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ("<robot ", "<robots ", "expected <robot>"),
        ("</robot>", "", "no URDF"),
        ("lbr_iiwa_link_7", "link_7", "no link 'lbr_iiwa_link_7'"),
    ],
)
def test_an_arm_that_cannot_be_is_a_mistake_of_its_user(
    tmp_path: Path, before: str, after: str, expected: str
) -> None:
    folder = ROBOTS["iiwa"].urdf.parent
    urdf = tmp_path / "arm.urdf"
    (tmp_path / "meshes").symlink_to(folder / "meshes")
    text = ROBOTS["iiwa"].urdf.read_text(encoding="utf-8").replace(before, after)
    if before == "<robot ":
        text = text.replace("</robot>", "</robots>")
    urdf.write_text(text, encoding="utf-8")
    with pytest.raises(UserError, match=expected):
        loaded(Cell(ROBOTS["iiwa"]._replace(urdf=urdf), (), ()), PERIOD_S)


def test_a_mesh_is_near_a_link_where_a_triangle_of_it_is(tmp_path: Path) -> None:
    # One large triangle beside the base of the arm: the box about it holds half of the cell.
    corners = np.array([[0.6, -0.6, 0.3], [0.6, 0.6, 0.3], [-0.6, 0.6, 0.3]])
    file = tmp_path / "triangle.obj"
    lines = [f"v {x} {y} {z}" for x, y, z in corners.tolist()]
    file.write_text("\n".join([*lines, "f 1 2 3"]) + "\n", encoding="utf-8")
    mesh = ForbiddenRegion.model_validate(
        {"name": "sheet", "shape": "mesh", "file": str(file), "position_m": [0, 0, 0]}
    )
    engine = MujocoEngine(Cell(ROBOTS["puma560"], (), (mesh,)), PERIOD_S, gui=False)
    names = {engine.link_name(link): link for link in range(1, 11)}
    base = names["base"]
    # The base is a cylinder of 0.1 m about z; the triangle's long edge passes through that.
    assert engine.links_touching([base], mesh, 0.002) == {base}
    # In the corner of the box about the triangle, which is half empty.
    beside = mesh.model_copy(update={"position_m": (-1.0, -0.1, 0.0)})
    assert engine.links_touching([base], beside, 0.002) == frozenset()
    away = mesh.model_copy(update={"position_m": (0.0707 + 0.105, 0.0707 + 0.105, 0.0)})
    assert engine.links_touching([base], away, 0.002) == frozenset()
    assert engine.links_touching([base], away, 0.2) == {base}


PENDULUM = """<robot name="pendulum"><link name="base"/>
<link name="bob"><inertial><origin xyz="0 0 0.5"/><mass value="1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0.5"/><geometry><mesh filename="bob.SUFFIX" scale="0.1 0.1 0.1"/>
</geometry></collision></link>
<joint name="swing" type="revolute"><parent link="base"/><child link="bob"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" velocity="2" effort="50"/></joint></robot>"""


@pytest.mark.parametrize("written", ["stl", "stl_ascii", "obj", "ply", "inside_out"])
def test_a_link_is_where_its_mesh_is_whatever_kind_of_file_that_is(
    tmp_path: Path, written: str
) -> None:
    bob = trimesh.creation.box((1.0, 1.0, 2.0))
    if written == "inside_out":
        bob.invert()
        # Open, too.
        bob.update_faces(np.arange(len(bob.faces)) > 1)
        written = "stl"
    suffix = written.removesuffix("_ascii")
    bob.export(tmp_path / f"bob.{suffix}", file_type=written)
    urdf = tmp_path / "pendulum.urdf"
    urdf.write_text(PENDULUM.replace("SUFFIX", suffix), encoding="utf-8")
    ball = Obstacle(name="ball", shape="sphere", position_m=(0.3, 0.0, 0.5), radius_m=0.05)
    model = RobotModel(urdf, "bob", 0.0, (0.0,), None)
    engine = MujocoEngine(Cell(model, (ball,), ()), PERIOD_S, gui=False)
    (near,) = engine.near_obstacles(1.0)
    # A box of 0.1 m about the z axis, and a ball of 0.05 m at 0.3 m.
    assert near.distances_m == pytest.approx([0.2], abs=1e-6)
    np.testing.assert_allclose(near.on_arm, [[0.05, 0.0, 0.5]], atol=1e-3)
    np.testing.assert_allclose(near.normals, [[-1.0, 0.0, 0.0]], atol=1e-3)


def test_without_a_display_a_window_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(UserError, match="Run without gui"):
        MujocoEngine(Cell(ROBOTS["puma560"], (), ()), PERIOD_S, gui=True)
