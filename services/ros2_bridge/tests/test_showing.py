from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from hmcs.bus.messages import Belief, Motion, RobotState
from hmcs.motion.quaternions import rotation_matrix
from hmcs.task import ForbiddenRegion, load_task
from hmcs_ros2_bridge import scene
from hmcs_ros2_bridge.fields import Fields
from hmcs_ros2_bridge.watching import (
    ERROR,
    OK,
    STALE,
    WARN,
    Seen,
    diagnostics,
    joint_state,
    json_of,
)

TASK = load_task("human-shapes")
BELIEF = Belief(
    model_hash="h",
    clock="c",
    step=3,
    states=("one", "two"),
    probabilities=np.array([0.2, 0.8]),
    likely_gesteme="two",
    segment_start=0,
)
ROBOT = RobotState(
    robot="arm",
    joint_positions=np.array([0.1, 0.2]),
    joint_velocities=np.zeros(2),
    tool_position=np.array([0.1, 0.2, 0.3]),
    tool_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
    tool_twist=np.zeros(6),
    reference_twist=np.zeros(6),
    nearest_obstacle="",
    nearest_distance_m=None,
    contacts=(),
    stop="none",
    limited=(),
)


def shown(region: ForbiddenRegion) -> list[Fields]:
    space = TASK.workspace.model_copy(update={"forbidden": (region,)})
    task = TASK.model_copy(update={"workspace": space})
    markers = scene.standing(task, 7, "base_link")
    return [marker for marker in markers if marker["ns"] == "forbidden/r"]


def points(marker: Fields) -> np.ndarray:
    return np.array([[point[axis] for axis in "xyz"] for point in marker["points"]])


def test_every_marker_is_distinguished_by_its_name_and_number_and_lies_in_the_frame() -> None:
    markers = scene.standing(TASK, 7, "base_link")
    names = [(marker["ns"], marker["id"]) for marker in markers]
    assert len(set(names)) == len(names)
    assert {"workspace", "obstacle/table", "obstacle/post"} == {name for name, _ in names}
    assert {marker["header"]["frame_id"] for marker in markers} == {"base_link"}


def test_the_workspace_is_drawn_by_its_twelve_edges() -> None:
    (box,) = [m for m in scene.standing(TASK, 0, "b") if m["ns"] == "workspace"]
    ends = points(box)
    assert len(ends) == 24
    assert ends.min(axis=0).tolist() == list(TASK.workspace.lower_m)
    assert ends.max(axis=0).tolist() == list(TASK.workspace.upper_m)
    lengths = np.linalg.norm(ends[::2] - ends[1::2], axis=1)
    sizes = np.subtract(TASK.workspace.upper_m, TASK.workspace.lower_m)
    assert sorted(lengths) == pytest.approx(sorted([*sizes] * 4))


def test_a_capsule_is_a_rod_between_two_balls() -> None:
    region = ForbiddenRegion(
        name="r", shape="capsule", position_m=(0, 0, 0), end_m=(0.4, 0, 0), radius_m=0.1
    )
    first, last, rod = shown(region)
    assert first["type"] == last["type"] == scene.SPHERE
    assert rod["type"] == scene.CYLINDER
    assert rod["scale"] == pytest.approx({"x": 0.2, "y": 0.2, "z": 0.4})
    turn = [rod["pose"]["orientation"][axis] for axis in "xyzw"]
    assert rotation_matrix(turn) @ [0, 0, 1] == pytest.approx([1, 0, 0])


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (1, 2, 3), (-1, 0, 0)])
def test_a_plane_faces_where_its_normal_points(normal: tuple[float, float, float]) -> None:
    (plate,) = shown(ForbiddenRegion(name="r", shape="plane", position_m=(0, 0, 0), normal=normal))
    turn = [plate["pose"]["orientation"][axis] for axis in "xyzw"]
    expected = np.array(normal) / np.linalg.norm(normal)
    assert rotation_matrix(turn) @ [0, 0, 1] == pytest.approx(expected, abs=1e-9)


def test_a_mesh_lies_where_the_task_places_it(tmp_path: Path) -> None:
    file = tmp_path / "box.stl"
    trimesh.creation.box((2.0, 2.0, 2.0)).export(file)
    region = ForbiddenRegion(
        name="r", shape="mesh", position_m=(1, 0, 0), file=str(file), scale=0.1
    )
    (mesh,) = shown(region)
    corners = points(mesh)
    assert len(corners) == 36
    assert corners.min(axis=0) == pytest.approx([0.9, -0.1, -0.1])
    assert corners.max(axis=0) == pytest.approx([1.1, 0.1, 0.1])


def test_a_guide_begins_where_the_fixture_says() -> None:
    path = np.array([[1.0, 1.0, 1.0], [1.0, 1.2, 1.0]])
    (line,) = scene.guide("g", path, np.array([0.5, 0.0, 0.3]), 0, "b", leads=True)
    assert points(line).ravel() == pytest.approx([0.5, 0.0, 0.3, 0.5, 0.2, 0.3])
    (gone,) = scene.no_guide("g", 0, "b")
    assert (gone["ns"], gone["id"], gone["action"]) == (line["ns"], line["id"], scene.DELETE)


def test_no_preferred_direction_takes_the_arrow_away() -> None:
    assert scene.direction(np.zeros(3), np.zeros(3), 0, "b")[0]["action"] == scene.DELETE
    (arrow,) = scene.direction(np.zeros(3), np.array([0.0, 1.0, 0.0]), 0, "b")
    assert points(arrow)[1].tolist() == [0.0, 0.1, 0.0]


def levels(seen: Seen) -> dict[str, tuple[bytes, str]]:
    shown = diagnostics(seen, ("robot/a",), 0)["status"]
    return {each["name"].removeprefix("hmcs: "): (each["level"], each["message"]) for each in shown}


def test_diagnostics_say_what_is_wrong_and_what_is_not_heard() -> None:
    nothing = levels(Seen())
    assert {level for name, (level, _) in nothing.items() if name != "services"} == {STALE}
    motion = Motion(position=np.zeros(3), velocity=np.zeros(3), dead_man=True)
    well = levels(Seen(robot=ROBOT, belief=BELIEF, motion=motion))
    assert well["robot"] == (OK, "following")
    assert well["recognition"] == (OK, "two")
    assert well["services"] == (OK, "robot/a")
    hit = ROBOT.model_copy(update={"stop": "collision"})
    lost = BELIEF.model_copy(update={"unknown_alarm": True})
    ill = levels(Seen(robot=hit, belief=lost))
    assert ill["robot"] == (ERROR, "collision")
    assert ill["recognition"][0] == WARN
    rests = ROBOT.model_copy(update={"stop": "disengaged"})
    assert levels(Seen(robot=rests))["robot"] == (OK, "disengaged")


def test_joints_without_names_are_numbered() -> None:
    assert joint_state(ROBOT, 0, "b")["name"] == ["joint_1", "joint_2"]


def test_json_has_every_field_with_arrays_as_lists() -> None:
    fields = json.loads(json_of(ROBOT)["data"])
    assert fields["tool_position"] == [0.1, 0.2, 0.3]
    assert set(fields) == set(RobotState.model_fields)
