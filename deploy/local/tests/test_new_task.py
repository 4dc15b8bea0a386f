from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hmcs.arms.state import Pose
from hmcs.errors import UserError
from hmcs.task import check_task, load_task
from hmcs_local.new_task import PLACES, PLANES, STATES, task_name_of, write_new_task
from hmcs_robot.set_up import simulated
from hmcs_robot.settings import RobotSettings
from hmcs_robot.simulation import Scene, Simulation
from support.arms import arm
from support.urdfs import arm as own_arm
from support.urdfs import written


@pytest.mark.parametrize("plane", [None, *PLANES])
@pytest.mark.parametrize("robot", PLACES)
def test_what_is_written_is_a_task_as_asked_for(tmp_path: Path, robot: str, plane: str) -> None:
    file = tmp_path / "pick.yaml"
    write_new_task(file, ("approach", "insert", "retract"), robot, plane)  # type: ignore[arg-type]
    assert not check_task(file)
    task = load_task(file)
    assert (task.name, task.robot.model) == ("pick", robot)
    assert "".join(task.recognition.axes) == (plane or "xyz")
    follow = {state.name: dict(state.next) for state in task.states}
    assert follow == {
        "approach": {"insert": 1.0},
        "insert": {"retract": 1.0},
        "retract": {"approach": 1.0},
    }
    assert dict(task.start) == {"approach": 1.0}


@pytest.mark.parametrize("robot", [arm(name) for name in PLACES])
def test_the_arm_reaches_where_a_new_task_begins(tmp_path: Path, robot: str) -> None:
    file = tmp_path / "pick.yaml"
    write_new_task(file, STATES, robot, None)
    task = load_task(file)
    start = task.robot.tool_start_m
    assert not task.workspace.excess_m(start)
    begin = Pose(np.array(start), np.array(task.robot.tool_orientation_xyzw))
    simulation = Simulation(Scene(robot, begin, ()), 1 / 240)
    np.testing.assert_allclose(simulation.read().tool.position, start, atol=1e-3)
    simulation.close()


def test_a_file_that_is_there_is_kept_unless_it_is_to_be_replaced(tmp_path: Path) -> None:
    file = tmp_path / "pick.yaml"
    file.write_text("mine")
    with pytest.raises(UserError, match="is there already: choose another name, or --force"):
        write_new_task(file, STATES, "puma560", None)
    assert file.read_text() == "mine"
    write_new_task(file, STATES, "puma560", None, force=True)
    assert load_task(file).name == "pick"


@pytest.mark.parametrize(
    ("name", "states", "robot", "problem"),
    [
        ("pick", ("a", "a"), "puma560", "--states: a, a: expected every state once"),
        ("pick", ("a b",), "puma560", "--states: state 'a b' cannot be part of a key"),
        ("pick", ("a",), "pandda", "did you mean panda?"),
        ("two words", ("a",), "panda", "name: 'two words' cannot be part of a key"),
    ],
)
def test_names_that_no_task_can_have_leave_no_file(
    tmp_path: Path, name: str, states: tuple[str, ...], robot: str, problem: str
) -> None:
    file = tmp_path / f"{name}.yaml"
    with pytest.raises(UserError) as caught:
        write_new_task(file, states, robot, None)
    assert problem in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there_is_an_error_of_one_line(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be written: No such file or directory"):
        write_new_task(tmp_path / "nowhere" / "pick.yaml", STATES, "puma560", None)


def test_the_ending_of_task_files_is_added_where_it_is_missing() -> None:
    assert task_name_of("pick") == Path("pick.yaml")
    assert task_name_of("pick.v2") == Path("pick.v2.yaml")
    assert task_name_of("tasks/pick.yml") == Path("tasks/pick.yml")


def test_a_task_of_an_own_arm_begins_at_its_home(tmp_path: Path) -> None:
    urdf = written(tmp_path, own_arm())
    file = tmp_path / "tasks" / "pick.yaml"
    file.parent.mkdir()
    write_new_task(file, STATES, str(urdf), None, tool_link="tool")
    task = load_task(file)
    assert Path(task.robot.urdf or "").resolve() == urdf
    assert not task.workspace.excess_m(task.robot.tool_start_m)
    simulation = simulated(task, RobotSettings())
    expected = [task.robot.home[k] for k in range(6)]  # type: ignore[index]
    np.testing.assert_allclose(simulation.read().joint_positions, expected, atol=5e-3)
    simulation.close()
    with pytest.raises(UserError, match="did you mean tool"):
        write_new_task(tmp_path / "a.yaml", STATES, str(urdf), None, tool_link="tol")
    with pytest.raises(UserError, match="puma560 has its own"):
        write_new_task(tmp_path / "b.yaml", STATES, "puma560", None, tool_link="tool")
    assert not (tmp_path / "a.yaml").exists()
