"""`hmcs robot`, and the how-to of an own robot followed from an empty folder."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image
from typer.testing import CliRunner

from hmcs.errors import UserError
from hmcs.task import load_task
from hmcs_local.command import app
from hmcs_robot.lockstep import LockstepRobot
from hmcs_robot.robots import ROBOTS
from support.urdfs import arm, written

HOW_TO = Path(__file__).parents[3] / "docs" / "how-to" / "own-robot.md"


def hmcs(words: str) -> str:
    """Run a command; return what it prints."""
    done = CliRunner().invoke(app, words.split(), catch_exceptions=True)
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.output


def test_the_robots_that_come_along_are_listed() -> None:
    listed = hmcs("robot list")
    assert all(name in listed for name in ROBOTS)
    assert "wrist_swivel_joint" in hmcs("robot check puma560")


def test_an_arm_is_shown_with_what_was_assumed_of_it(tmp_path: Path) -> None:
    file = written(tmp_path, arm().replace('effort="200"', "", 1))
    shown = hmcs(f"robot check {file}")
    assert re.search(r"j1 +revolute +-2\.8 … 2\.8 rad +2 rad/s +20000 N·m +effort", shown)
    assert f"{file}:4: joint j1 has no effort: 20000 N·m assumed" in shown
    assert "reach: 1.4" in shown


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("robot check none.urdf", "no such file; expected a URDF"),
        ("robot check {file} --output {folder}/arm.txt", "expected a name that ends in .png"),
        ("robot check {file} --output {folder}/no/arm.png", "there is no folder"),
        ("robot check {file} --tool-link tol", "did you mean tool"),
    ],
)
def test_what_cannot_be_shown_is_refused(tmp_path: Path, words: str, said: str) -> None:
    file = written(tmp_path, arm())
    with pytest.raises(UserError, match=said):
        hmcs(words.format(file=file, folder=tmp_path))


def test_the_how_to_of_an_own_robot_is_followed_from_an_empty_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    written(tmp_path, arm()).rename("my_arm.urdf")
    text = HOW_TO.read_text(encoding="utf-8")
    commands = [
        line.removeprefix("hmcs ")
        for block in re.findall(r"```bash\n(.*?)```", text, re.DOTALL)
        for line in block.splitlines()
    ]
    look, new, check, up = commands
    shown = hmcs(look)
    with Image.open("my_arm.png") as picture:
        assert np.asarray(picture.convert("L")).std() > 10
    hmcs(new)
    task_file = Path(up.split()[1])
    assert "in order" in hmcs(check)
    task = load_task(task_file)
    assert task.robot.name == "my_arm"
    robot_that_is_up = LockstepRobot(task)
    np.testing.assert_allclose(robot_that_is_up.position, task.robot.tool_start_m, atol=1e-3)
    robot_that_is_up.close()
    # The start that was shown is one that the arm reaches.
    (start, turned) = re.findall(
        r"tool_start_m: (\[.*?\]), tool_orientation_xyzw: (\[.*?\])", shown
    )[0]
    setup = task.robot.model_copy(
        update={
            "tool_start_m": tuple(yaml.safe_load(start)),
            "tool_orientation_xyzw": tuple(yaml.safe_load(turned)),
        }
    )
    LockstepRobot(task.model_copy(update={"robot": setup})).close()


def test_a_task_whose_own_arm_cannot_be_is_refused_by_the_check_of_tasks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    hmcs("new pick")
    data = yaml.safe_load(Path("pick.yaml").read_text(encoding="utf-8"))
    data["robot"] = {**data["robot"], "urdf": "own.urdf"}
    del data["robot"]["model"]
    Path("pick.yaml").write_text(yaml.safe_dump(data), encoding="utf-8")
    with pytest.raises(UserError, match=r"own.urdf: no such file"):
        hmcs("task check pick.yaml")
    written(tmp_path, arm())
    assert "in order" in hmcs("task check pick.yaml")
