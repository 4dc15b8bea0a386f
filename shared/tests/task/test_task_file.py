"""Task files: every mistake is reported with line and field."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from hmcs.errors import UserError
from hmcs.task import TaskFileError, check_task, format_problems, load_task
from support.task_files import GOOD, Check


def test_a_right_file_has_no_problem(check: Check) -> None:
    assert check(GOOD) == []


MISTAKES = [
    ("dead_zone_m: 0.01", "dead_zone_m: 0", 3, "dead_zone_m", "greater than 0"),
    ("dead_zone_m: 0.01", "dead_zone_m: 0.21", 3, "dead_zone_m", "less than or equal to 0.2"),
    ("dead_zone_m: 0.01", "dead_zone_m: .nan", 3, "dead_zone_m", "finite"),
    ("dead_zone_m: 0.01", "dead_zone_m: wide", 3, "dead_zone_m", "valid number"),
    ("dead_zone_m: 0.01\n", "", 1, "dead_zone_m", "missing: δ"),
    ("hmcs-task/1", "hmcs-task/2", 1, "format", "'hmcs-task/1'"),
    ("name: small", "name: sm all", 2, "name", "cannot be part of a key"),
    ("name: small", "name: on", 2, "name", "put quotes"),
    ("name: small", "nome: small", 2, "nome", "did you mean name?"),
    ("{name: up}", "{name: up*}", 5, "gestemes[0].name", "cannot be part of a key"),
    ("{name: down}", "{name: up}", 6, "gestemes[1].name", "another one already"),
    ("gestemes: [up]", "gestemes: [upp]", 9, "states[0].gestemes[0]", "did you mean up?"),
    ("gestemes: [up]", "gestemes: [up, up]", 9, "states[0].gestemes[1]", "stands twice"),
    ("gestemes: [up]", "gestemes: []", 9, "states[0].gestemes", "at least 1"),
    ("gestemes: [up]", "gestemes: up", 9, "states[0].gestemes", "valid tuple"),
    ("next: [fall]", "next: [fell]", 10, "states[0].next.fell", "did you mean fall?"),
    ("next: [fall]", "next: [fall, fall]", 10, "states[0].next", "stands twice"),
    ("next: [fall]", "next: fall", 10, "states[0].next", "valid dictionary"),
    ("next: [fall]", "next: []", 11, "states[1].name", "can never be reached"),
    ("rise: 0.5, fall: 0.5", "rise: 0.5, fall: 0.4", 13, "states[1].next", "sum to 0.9"),
    ("rise: 0.5, fall: 0.5", "rise: 0, fall: 1", 13, "states[1].next", "0 < p <= 1"),
    ("rise: 0.5, fall: 0.5", "rise: 1.5, fall: -0.5", 13, "states[1].next", "0 < p <= 1"),
    ("rise: 0.5, fall: 0.5", "rise: .nan, fall: 1", 13, "states[1].next", "0 < p <= 1"),
    ("name: fall\n", "name: rise\n", 11, "states[1].name", "another one already"),
    ("start: [rise]", "start: [raise]", 14, "start.raise", "did you mean rise?"),
    ("start: [rise]", "start: []", 14, "start", "at least 1"),
    ("lower_m: [-1, -1, 0]", "lower_m: [-1, 1, 0]", 15, "workspace", "along y"),
    ("lower_m: [-1, -1, 0]", "lower_m: [-1, -1]", 16, "workspace.lower_m[2]", "missing"),
    ("radius_m: 0.1", "length_m: 0.1", 19, "workspace.obstacles[0]", "needs radius_m"),
    ("radius_m: 0.1", "radius_m: -1", 19, "workspace.obstacles[0].radius_m", "greater than 0"),
    ("sphere", "ball", 19, "workspace.obstacles[0].shape", "'box', 'sphere' or 'cylinder'"),
    ("model: puma560", "model: puma", 21, "robot.model", "did you mean puma560?"),
    ("tool_start_m: [0, 0, 0.5]", "tool_start_m: [0, 2, 1.5]", 22, "robot.tool_start_m", "along z"),
    ("[0, 0, 0, 1]", "[0, 0, 0, 2]", 23, "robot.tool_orientation_xyzw", "length 2"),
    ("name: small\n", "name: small\nname: again\n", 3, "name", "second time"),
    ("start: [rise]", "start: [rise]\nrecognition: {axes: [x, x]}", 15, "recognition.axes", "once"),
    (
        "start: [rise]",
        'start: [rise]\ndrawings: {scale: 1, plane: ["-y", "y"]}',
        15,
        "drawings.plane",
        "once",
    ),
]


@pytest.mark.parametrize(("old", "new", "line", "path", "said"), MISTAKES)
def test_a_mistake_is_reported_at_its_line_and_field(
    check: Check, old: str, new: str, line: int, path: str, said: str
) -> None:
    assert old in GOOD
    problems = check(GOOD.replace(old, new, 1))
    heard = [(p.line, p.path) for p in problems if said in p.message]
    assert (line, path) in heard, format_problems(problems)


def test_all_mistakes_of_a_file_are_reported_at_once_in_order(check: Check) -> None:
    text = GOOD
    some = [0, 11, 15, 24, 33]
    for old, new, *_ in (MISTAKES[index] for index in some):
        text = text.replace(old, new, 1)
    problems = check(text)
    assert [p.path for p in problems] == [MISTAKES[index][3] for index in some]
    assert [p.line for p in problems] == sorted(p.line for p in problems)


def test_a_mistake_in_a_state_does_not_make_up_others(check: Check) -> None:
    # What cannot be read cannot be known to be unreachable or unknown.
    problems = check(GOOD.replace("gestemes: [up]", "gestemes: 7"))
    assert [p.path for p in problems] == ["states[0].gestemes"]


@pytest.mark.parametrize(
    ("content", "line", "said"),
    [
        ("", 1, "empty"),
        ("# nothing\n", 1, "empty"),
        ("- a\n- b\n", 1, "a list, expected a mapping"),
        ("just words\n", 1, "expected a mapping"),
        (GOOD + "more: [1, 2\n", 25, "not YAML"),
        ("name: x\n  bad: y\n", 2, "not YAML"),
        ("a: 1\n\tb: 2\n", 2, "not YAML"),
        ("a: 1\n---\nb: 2\n", 2, "not YAML"),
        ("a: &a [1, *a]\n", 1, "holds itself"),
        ("a: *b\n", 1, "not YAML"),
        ("a: \x01\n", 1, "not YAML text"),
        ("a: !!python/object:os.system {}\n", 1, "not YAML"),
    ],
)
def test_what_is_no_mapping_is_reported(check: Check, content: str, line: int, said: str) -> None:
    (problem,) = check(content)
    assert said in problem.message
    assert problem.line == line


def test_bytes_that_are_no_text_are_reported(tmp_path: Path) -> None:
    file = tmp_path / "t.yaml"
    file.write_bytes(b"name: x\nother: \xff\n")
    (problem,) = check_task(file)
    assert (problem.line, problem.message) == (2, "not UTF-8 text, expected a YAML file")


def test_a_task_that_is_not_there_is_a_users_mistake_that_names_the_choices(tmp_path: Path) -> None:
    with pytest.raises(TaskFileError, match="human-shapes, lines-through-obstacles"):
        load_task("human-shape")
    with pytest.raises(UserError, match="a folder"):
        load_task(tmp_path)


def test_the_error_has_a_line_for_each_mistake(tmp_path: Path) -> None:
    file = tmp_path / "t.yaml"
    file.write_text(GOOD.replace("puma560", "p").replace("0.01", "7"))
    with pytest.raises(TaskFileError) as caught:
        load_task(file)
    lines = str(caught.value).splitlines()
    assert [line.split(": ")[:2] for line in lines] == [
        [f"{file}:3", "dead_zone_m"],
        [f"{file}:21", "robot.model"],
    ]


json_values = st.recursive(
    st.none() | st.booleans() | st.integers(-5, 5) | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=6,
)


@given(st.data())
def test_any_value_anywhere_is_reported_as_a_problem_or_taken(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    task: Any = copy.deepcopy(yaml.safe_load(GOOD))
    place: Any = task
    while True:
        keys = list(place) if isinstance(place, dict) else list(range(len(place)))
        key = data.draw(st.sampled_from(keys))
        if not isinstance(place[key], (dict, list)) or not place[key] or data.draw(st.booleans()):
            place[key] = data.draw(json_values)
            break
        place = place[key]
    file = tmp_path_factory.mktemp("fuzz") / "t.yaml"
    file.write_text(yaml.safe_dump(task, allow_unicode=True), encoding="utf-8")
    problems = check_task(file)
    lines = len(file.read_text(encoding="utf-8").splitlines())
    assert all(1 <= problem.line <= lines for problem in problems)
    if not problems:
        load_task(file)
