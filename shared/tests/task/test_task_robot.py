"""The robot of a task file: one that comes along, or an arm of one's own."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from hmcs.task import load_task
from support.task_files import GOOD, Check


@pytest.mark.parametrize(
    ("robot", "said"),
    [
        ("", "no robot is named, expected model: NAME (one of iiwa, panda, puma560) or"),
        ("model: panda\nurdf: a.urdf\n", "both model and urdf are given"),
        ("model: panda\ntool_link: t\n", "tool_link belongs to an arm of your own"),
    ],
)
def test_a_robot_is_one_that_comes_along_or_ones_own(check: Check, robot: str, said: str) -> None:
    indent = re.search(r"^( *)model: puma560\n", GOOD, re.MULTILINE)
    assert indent is not None
    lines = "".join(f"{indent.group(1)}{line}\n" for line in robot.splitlines())
    (problem,) = check(GOOD.replace(indent.group(0), lines))
    assert problem.path == "robot"
    assert said in problem.message


def test_an_own_arm_is_found_beside_the_task_and_named_shortly(tmp_path: Path) -> None:
    file = tmp_path / "t.yaml"
    file.write_text(GOOD.replace("model: puma560", "urdf: arms/my arm.v2.urdf"))
    robot = load_task(file).robot
    assert robot.urdf == str(tmp_path.resolve() / "arms" / "my arm.v2.urdf")
    assert robot.name == "my-arm.v2"
