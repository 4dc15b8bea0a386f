"""What is loaded to be drawn: models, guides, robots; and who draws it."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import yourdfpy
from numpy.testing import assert_allclose

from hmcs.bus.messages import Motion, RobotDescription, RobotState
from hmcs_console.drawing.drawn_guides import thickness_of
from hmcs_console.drawing.drawn_robot import DrawnRobot
from hmcs_console.drawing.robot_model import joints_of, load_robot, written
from hmcs_console.seeing.seen import FORGOTTEN_S, Seen
from hmcs_console.serving.painter import Painter
from hmcs_console.serving.server import Server

LOG = logging.getLogger("test")
URDF = """<robot name="arm"><link name="base"/><link name="upper"><visual><geometry>
<mesh filename="package://arm/upper.stl"/></geometry></visual></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>"""
TRIANGLE = b"""solid t
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
endsolid t
"""


def test_a_robot_is_loaded_with_the_meshes_that_came_with_it() -> None:
    robot_description = RobotDescription(
        robot="arm", urdf=URDF, joints=("j1",), files={"package://arm/upper.stl": TRIANGLE}
    )
    robot = load_robot(robot_description)
    assert len(robot.scene.geometry) == 1


def test_files_from_the_wire_stay_in_their_folder(tmp_path: Path) -> None:
    folder = tmp_path / "inside"
    folder.mkdir()
    files = ("../../outside.stl", "/etc/outside.stl", "a/..", "..", "", "..\\..\\outside.stl")
    names = written(dict.fromkeys(files, b"1"), folder)
    assert set(names) == {"../../outside.stl", "/etc/outside.stl", "..\\..\\outside.stl"}
    assert all(Path(place).resolve().is_relative_to(folder) for place in names.values())
    assert list(tmp_path.rglob("*.stl")) == list(folder.rglob("*.stl"))


def test_a_mesh_finds_its_materials_beside_it(tmp_path: Path) -> None:
    names = written({"m/link.obj": b"1", "m/link.mtl": b"2", "n/link.obj": b"3"}, tmp_path)
    assert Path(names["m/link.obj"]).with_suffix(".mtl").read_bytes() == b"2"
    assert Path(names["n/link.obj"]).read_bytes() == b"3"


def test_a_guide_is_drawn_thicker_the_stiffer_the_fixture_is() -> None:
    free, half, stiff = map(thickness_of, (0.5, 0.75, 1.0))
    assert free < half < stiff
    assert thickness_of(0.0) == free


def moving() -> yourdfpy.URDF:
    """An arm with every kind of joint there is, its axes and origins awry."""
    joints = [
        ("turn", "revolute", 'xyz="1 2 -1"', ""),
        ("still", "fixed", "", ""),
        ("slide", "prismatic", 'xyz="0 -1 0"', ""),
        ("wheel", "continuous", 'xyz="-1 0 0"', ""),
        (
            "finger",
            "prismatic",
            'xyz="0 1 0"',
            '<mimic joint="slide" multiplier="-2" offset="0.1"/>',
        ),
        ("thumb", "revolute", 'xyz="0 0 1"', '<mimic joint="turn" multiplier="0.5" offset="0.2"/>'),
    ]
    links = "".join(f'<link name="l{number}"/>' for number in range(len(joints) + 1))
    reported = "".join(
        f'<joint name="{name}" type="{kind}">'
        f'<parent link="l{number}"/><child link="l{number + 1}"/>'
        f'<origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.5 {number}"/>{axis and f"<axis {axis}/>"}{mimic}'
        '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
        for number, (name, kind, axis, mimic) in enumerate(joints)
    )
    return load_robot(
        RobotDescription(
            robot="arm", urdf=f'<robot name="arm">{links}{reported}</robot>', joints=(), files={}
        )
    )


def poses(robot: DrawnRobot) -> list[tuple[list[float], list[float]]]:
    """Position, and orientation with its sign made even, of every joint's frame."""
    return [
        (frame.position.tolist(), (frame.wxyz * np.sign(frame.wxyz[0])).tolist())
        for frame in robot._joint_frames
    ]


def test_a_robot_is_drawn_as_its_description_would_have_it_move() -> None:
    server = Server(LOG)
    quick, exact = DrawnRobot(server, moving(), "/quick"), DrawnRobot(server, moving(), "/exact")
    for joints in (
        {"turn": 0.7, "slide": -0.3, "wheel": 2.5},
        {"turn": 0.0, "slide": 0.05, "wheel": -2.5},
        {"turn": -1.2, "slide": 0.0, "wheel": 0.0},
    ):
        quick.move(joints)
        exact.update_cfg(joints)  # type: ignore[arg-type]
        for one, other in zip(poses(quick), poses(exact), strict=True):
            assert_allclose(one[0], other[0], atol=1e-9)
            assert_allclose(one[1], other[1], atol=1e-9)
    server.stop()


def test_a_joint_that_is_not_reported_or_hardly_moved_stays_as_it_is_drawn() -> None:
    server = Server(LOG)
    robot = DrawnRobot(server, moving(), "/robot")
    robot.move({"turn": 0.5, "wheel": 1.0})
    before = poses(robot)
    robot.move({"turn": 0.50005})
    robot.move({"strange": 1.0})
    assert poses(robot) == before
    robot.move({"turn": 0.6})
    assert poses(robot) != before
    server.stop()


def test_joints_are_reported_by_their_names() -> None:
    robot_description = RobotDescription(robot="arm", urdf=URDF, joints=("j1", "j2"), files={})
    assert joints_of(robot_description, np.array([0.5, 0.7])) == {"j1": 0.5, "j2": 0.7}


# --- what is kept ---------------------------------------------------------------------------------


def robot_at(x_m: float) -> RobotState:
    return RobotState(
        robot="arm",
        joint_positions=np.zeros(1),
        joint_velocities=np.zeros(1),
        tool_position=np.array([x_m, 0.0, 0.0]),
        tool_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        tool_twist=np.zeros(6),
        reference_twist=np.zeros(6),
        nearest_obstacle="",
        nearest_distance_m=None,
        contacts=(),
        stop="none",
        limited=(),
    )


def hand_at(x_m: float, **fields: Any) -> Motion:
    held = {"dead_man": True} | fields
    return Motion(position=np.array([x_m, 0.0, 0.0]), velocity=np.zeros(3), **held)


def test_a_robot_that_fell_silent_is_not_shown_as_being_there() -> None:
    seen = Seen(())
    seen.robot_moved(10.0, robot_at(1.0))
    assert seen.picture(10.0 + FORGOTTEN_S, "", None).robot is not None
    assert seen.picture(10.1 + FORGOTTEN_S, "", None).robot is None


def test_the_hands_trail_begins_at_the_tool_whenever_the_hand_takes_hold() -> None:
    seen = Seen(())
    seen.hand_moved(hand_at(5.0))
    seen.robot_moved(10.0, robot_at(1.0))
    for x_m in (7.0, 7.1):
        seen.hand_moved(hand_at(x_m))
    seen.hand_moved(hand_at(7.1, clutch=True))
    seen.robot_moved(10.1, robot_at(2.0))
    for x_m in (0.0, 0.2):
        seen.hand_moved(hand_at(x_m))
    segments, _ = seen.picture(10.1, "", None).hand_trail
    assert_allclose(segments[:, :, 0], [[1.0, 1.1], [2.0, 2.2]], rtol=1e-6)


# --- the painter ----------------------------------------------------------------------------------


def wait_until(condition: Callable[[], object]) -> None:
    deadline_s = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < deadline_s
        time.sleep(0.005)


def test_a_painter_that_hangs_holds_nobody_up_and_leaves_out_what_it_has_no_time_for() -> None:
    drawn: list[int] = []
    go_on = threading.Event()

    def draw(number: int) -> None:
        go_on.wait(10.0)
        drawn.append(number)

    painter = Painter(draw, 50.0, LOG)
    began_s = time.monotonic()
    painter.show(0.0, 0)
    wait_until(lambda: painter.due(1e9))
    for number in range(1, 1000):
        painter.show(0.0, number)
    assert time.monotonic() - began_s < 1.0
    assert not painter.due(1e9)
    time.sleep(0.05)
    go_on.set()
    wait_until(lambda: len(drawn) == 2)
    wait_until(lambda: painter.due(1e9))
    assert drawn == [0, 1]
    painter.close()


def test_a_slow_painter_is_shown_less() -> None:
    painter = Painter(lambda _: time.sleep(0.05), 50.0, LOG)
    painter.show(10.0, 0)
    assert not painter.due(10.015)
    wait_until(lambda: painter.rate_hz < 50.0)
    painter.show(10.0, 1)
    assert not painter.due(10.03)
    painter.close()


def test_a_failed_drawing_is_reported_until_one_succeeds() -> None:
    drawn: list[int] = []

    def draw(number: int) -> None:
        drawn.append(number)
        if number == 0:
            raise RuntimeError("no paint")

    painter = Painter(draw, 50.0, LOG)
    painter.show(0.0, 0)
    wait_until(lambda: painter.failure)
    assert painter.failure == "RuntimeError: no paint"
    painter.show(0.0, 1)
    wait_until(lambda: not painter.failure)
    assert drawn == [0, 1]
    painter.close()
