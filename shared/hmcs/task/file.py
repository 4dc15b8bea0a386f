"""Task files: read with every mistake reported, each with its line."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from difflib import get_close_matches
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, get_args

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from hmcs.bounded_files import UnreadableFileError, read_bounded
from hmcs.errors import UserError
from hmcs.task.fixture_parts import FixtureSetup
from hmcs.task.model import Draft, Location, Task, contradictions
from hmcs.task.parts import (
    ForbiddenRegion,
    Gesteme,
    Obstacle,
    RobotSetup,
    State,
    Workspace,
)
from hmcs.task.values import Distribution, unknown_name_message
from hmcs.task.yaml_lines import Document, YamlError, read_yaml

T = TypeVar("T")

MOST_BYTES = 256 * 1024
"""A task of a hundred states, each with a fixture of its own, takes some 60,000; reading takes up
to a second for so many."""
MOST_TOLD = 50
"""Mistakes that are reported for a file; the others show once these are mended."""
LONGEST_MESSAGE = 500
"""Characters of the message about one mistake, which may quote the file."""


class Problem(NamedTuple):
    """One mistake in a task file."""

    file: str
    line: int
    path: str
    """Of the field, e.g. `states[2].gestemes[0]`; empty for the file as a whole."""
    message: str

    def __str__(self) -> str:
        path = f"{self.path}: " if self.path else ""
        return f"{self.file}:{self.line}: {path}{self.message}"


class TaskFileError(UserError):
    """A file that is no task; its message has a line for each mistake."""

    def __init__(self, problems: list[Problem]) -> None:
        super().__init__(format_problems(problems))
        self.problems = problems


def load_task(path_or_name: str | Path) -> Task:
    """Return a task from a YAML file, or one of the shipped tasks by its name.

    Raises TaskFileError listing every mistake of the file with its line and field.
    """
    file = find_task(path_or_name)
    task, problems = _read(file)
    if task is None:
        raise TaskFileError(problems)
    return _with_files_beside(task, file)


def check_task(path_or_name: str | Path) -> list[Problem]:
    """Return every mistake of a task file, in the order of its lines; none where it is right."""
    try:
        return _read(find_task(path_or_name))[1]
    except TaskFileError as error:
        return error.problems


def problem_at(path_or_name: str | Path, location: Location, message: str) -> Problem:
    """Return a mistake that stands at a field of a task file, with its line."""
    file = find_task(path_or_name)
    document = read_yaml(_text(file))
    return Problem(str(file), _line(document, location), _dotted(location), message)


def format_problems(problems: list[Problem]) -> str:
    """Return a line for each mistake: `file:line: field: what is wrong`."""
    return "\n".join(str(problem) for problem in problems)


def shipped_tasks() -> tuple[str, ...]:
    """Return the names of the tasks that come with HMCS."""
    return tuple(sorted(file.stem for file in _shipped_folder().glob("*.yaml")))


def find_task(path_or_name: str | Path) -> Path:
    """Return the file of a task given by its path, or by its name where it is shipped.

    Raises TaskFileError where there is none.
    """
    if str(path_or_name) in shipped_tasks():
        return _shipped_folder() / f"{path_or_name}.yaml"
    try:
        read_bounded(path_or_name, MOST_BYTES)
    except UnreadableFileError as error:
        names = ", ".join(shipped_tasks())
        near = get_close_matches(str(path_or_name), _task_names(Path(path_or_name).parent), n=1)
        guess = f", did you mean {near[0]}?" if near else ";"
        message = f"{error.what}{guess} expected a task file or one of the shipped tasks ({names})"
        raise TaskFileError([Problem(str(path_or_name), 1, "", message)]) from error
    return Path(path_or_name)


def _task_names(folder: Path) -> list[str]:
    """What a task can be called: the shipped ones, and the files of a folder."""
    files = folder.glob("*.y*ml") if folder.is_dir() else ()
    return [*shipped_tasks(), *map(str, files)]


def _with_files_beside(task: Task, file: Path) -> Task:
    """Return the task with the files and folders that it names as absolute paths."""
    workspace, robot = task.workspace, task.robot
    if any(region.file is not None for region in workspace.forbidden):
        forbidden = tuple(
            region
            if region.file is None
            else region.model_copy(
                update={
                    "file": _beside(file, ("workspace", "forbidden", index, "file"), region.file)
                }
            )
            for index, region in enumerate(workspace.forbidden)
        )
        workspace = workspace.model_copy(update={"forbidden": forbidden})
    if robot.urdf is not None:
        folders = tuple(
            _beside(file, ("robot", "package_path", index), folder)
            for index, folder in enumerate(robot.package_path)
        )
        urdf = _beside(file, ("robot", "urdf"), robot.urdf)
        robot = robot.model_copy(update={"urdf": urdf, "package_path": folders})
    return task.model_copy(update={"workspace": workspace, "robot": robot})


def _beside(file: Path, location: Location, named: str) -> str:
    path = file.parent / named
    try:
        # From Python 3.13 on, to resolve a circle of links is no error.
        with suppress(FileNotFoundError, NotADirectoryError, PermissionError):
            path.stat()
        return str(path.resolve())
    except (OSError, RuntimeError, ValueError) as error:
        # A null byte, or links that lead in a circle.
        problem = problem_at(file, location, f"{named!r:.60} cannot be a path: {error}")
        raise TaskFileError([problem]) from error


def _shipped_folder() -> Path:
    return Path(str(resources.files("hmcs"))) / "tasks"


def _text(file: Path) -> str:
    """Return the text of a task file; raises UnreadableFileError and UnicodeDecodeError."""
    return read_bounded(file, MOST_BYTES).decode("utf-8-sig")


def _read(file: Path) -> tuple[Task | None, list[Problem]]:
    try:
        document = read_yaml(_text(file))
    except UnreadableFileError as error:
        return None, [Problem(str(file), 1, "", error.what)]
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        return None, [Problem(str(file), line, "", "not UTF-8 text, expected a YAML file")]
    except YamlError as error:
        return None, [Problem(str(file), error.line, "", error.message)]
    data = document.data
    if data is None:
        return None, [Problem(str(file), 1, "", f"empty, expected a task: {_fields(Task)}")]
    if not isinstance(data, dict):
        kind = {list: "a list"}.get(type(data), f"the text {data!r:.40}")
        return None, [Problem(str(file), 1, "", f"{kind}, expected a mapping: {_fields(Task)}")]
    found = [(key, "stands here a second time, expected once") for key in document.repeated]
    task = None
    try:
        task = Task.model_validate(data)
    except ValidationError as error:
        details = error.errors(include_url=False)
        # Contradictions of the whole come without a location; the draft tells them with one.
        found += [_explain(detail) for detail in details[: MOST_TOLD + 1] if detail["loc"]]
        found += contradictions(_draft(data))
    return None if found else task, _problems(file, document, found)


def _problems(
    file: Path, document: Document, found: Sequence[tuple[Location, str]]
) -> list[Problem]:
    """Return the mistakes in the order of their lines, `MOST_TOLD` of them at most."""
    problems = [
        Problem(str(file), _line(document, location), _dotted(location), _shortened(message))
        for location, message in found[:MOST_TOLD]
    ]
    problems.sort(key=lambda problem: problem.line)
    if len(found) > MOST_TOLD:
        problems.append(
            Problem(str(file), problems[-1].line, "", "there are more mistakes: mend these first")
        )
    return problems


def _shortened(message: str) -> str:
    return message if len(message) <= LONGEST_MESSAGE else f"{message[: LONGEST_MESSAGE - 1]}…"


def _draft(data: dict[Any, Any]) -> Draft:
    gestemes, gestemes_right = _each(Gesteme, data.get("gestemes"))
    states, states_right = _each(State, data.get("states"))
    box = data.get("workspace")
    box = box if isinstance(box, dict) else {}
    return Draft(
        gestemes,
        states,
        _valid(Distribution, data.get("start")),
        _each(Obstacle, box.get("obstacles"))[0],
        _valid(Workspace, {**box, "obstacles": (), "forbidden": ()}),
        _valid(RobotSetup, data.get("robot")),
        complete=gestemes_right and states_right,
        forbidden=_each(ForbiddenRegion, box.get("forbidden"))[0],
        dead_zone_m=_valid(float, data.get("dead_zone_m")),
        fixture=_valid(FixtureSetup, data.get("fixture") or {}),
    )


def _each(part: type[T], data: object) -> tuple[list[tuple[int, T]], bool]:
    if not isinstance(data, list):
        return [], False
    parts = [(index, _valid(part, item)) for index, item in enumerate(data)]
    right = [(index, item) for index, item in parts if item is not None]
    return right, len(right) == len(parts)


def _valid(part: Any, data: object) -> Any:
    try:
        return TypeAdapter(part).validate_python(data)
    except ValidationError:
        return None


def _explain(detail: ErrorDetails) -> tuple[Location, str]:
    location, kind = tuple(detail["loc"]), detail["type"]
    if kind == "extra_forbidden":
        model = _model_at(location[:-1])
        choices = list(model.model_fields) if model else []
        return location, unknown_name_message("key", str(location[-1]), choices)
    if kind == "missing":
        model = _model_at(location[:-1])
        about = model.model_fields[str(location[-1])].description if model else None
        return location, "missing" + (f": {' '.join(about.split())}" if about else "")
    message = detail["msg"].removeprefix("Value error, ")
    message = message[:1].lower() + message[1:]
    value = detail["input"]
    if kind in ("string_type", "literal_error") and isinstance(value, (bool, int, float)):
        message += f", got {value!r}: put quotes around a name that looks like a number or a yes"
    elif kind != "value_error":
        message += f", got {value!r:.60}"
    return location, message


def _model_at(location: Location) -> type[BaseModel] | None:
    model: type[BaseModel] | None = Task
    for part in location:
        if model is None or isinstance(part, int):
            continue
        field = model.model_fields.get(part)
        model = _model_in(field.annotation) if field else None
    return model


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((model for part in get_args(annotation) if (model := _model_in(part))), None)


def _line(document: Document, location: Location) -> int:
    # A distribution written as a list has no line for a name, but one for the name's place.
    if len(location) > 1 and location not in document.lines:
        value: Any = document.data
        for part in location[:-1]:
            try:
                value = value[part]
            except (KeyError, IndexError, TypeError):
                return document.line_of(location)
        if isinstance(value, list) and location[-1] in value:
            return document.line_of((*location[:-1], value.index(location[-1])))
    return document.line_of(location)


def _dotted(location: Location) -> str:
    path = ""
    for part in location:
        path += f"[{part}]" if isinstance(part, int) else f".{part}" if path else part
    return path


def _fields(model: type[BaseModel]) -> str:
    return ", ".join(model.model_fields)
