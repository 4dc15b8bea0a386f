"""The task: gestemes, task states and their order, workspace, robot, fixture.

A task is written in YAML (`hmcs/tasks/` holds those that come along) and read with `load_task`.
What each field means stands in `parts`, what the parts must agree on in `model`.
"""

from hmcs.task.file import (
    Problem,
    TaskFileError,
    check_task,
    find_task,
    format_problems,
    load_task,
    problem_at,
    shipped_tasks,
)
from hmcs.task.fixture_parts import FixtureSetup
from hmcs.task.model import Task
from hmcs.task.parts import (
    Drawings,
    ForbiddenRegion,
    Gesteme,
    Obstacle,
    Recognition,
    RobotSetup,
    State,
    ToolSetup,
    Workspace,
)
from hmcs.task.values import AXES

__all__ = [
    "AXES",
    "Drawings",
    "FixtureSetup",
    "ForbiddenRegion",
    "Gesteme",
    "Obstacle",
    "Problem",
    "Recognition",
    "RobotSetup",
    "State",
    "Task",
    "TaskFileError",
    "ToolSetup",
    "Workspace",
    "check_task",
    "find_task",
    "format_problems",
    "load_task",
    "problem_at",
    "shipped_tasks",
]
