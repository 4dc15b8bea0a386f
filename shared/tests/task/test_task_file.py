"""Task files: the shipped ones hold together, and every mistake is reported with line and field."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from hmcs.bus.keys import KeyNameError, check_name
from hmcs.errors import UserError
from hmcs.motion.demonstrations import read_csv
from hmcs.task import (
    Problem,
    Task,
    TaskFileError,
    check_task,
    find_task,
    format_problems,
    load_task,
    shipped_tasks,
)
from hmcs.task.parts import Obstacle

GOOD = """\
format: hmcs-task/1
name: small
dead_zone_m: 0.01
gestemes:
  - {name: up}
  - {name: down}
states:
  - name: rise
    gestemes: [up]
    next: [fall]
  - name: fall
    gestemes: [down]
    next: {rise: 0.5, fall: 0.5}
start: [rise]
workspace:
  lower_m: [-1, -1, 0]
  upper_m: [1, 1, 1]
  obstacles:
    - {name: ball, shape: sphere, position_m: [0, 0, 0], radius_m: 0.1}
robot:
  model: puma560
  tool_start_m: [0, 0, 0.5]
  tool_orientation_xyzw: [0, 0, 0, 1]
"""


Check = Callable[[str], list[Problem]]


@pytest.fixture
def check(tmp_path: Path) -> Check:
    """Return a function that checks a text as a task file."""

    def checked(text: str) -> list[Problem]:
        file = tmp_path / "task.yaml"
        file.write_text(text, encoding="utf-8")
        return check_task(file)

    return checked


def test_a_right_file_has_no_problem(check: Check) -> None:
    assert check(GOOD) == []


def test_both_shipped_tasks_are_right_and_found_by_name() -> None:
    assert shipped_tasks() == ("human-shapes", "lines-through-obstacles", "object-3d", "surface-2d")
    for name in shipped_tasks():
        assert check_task(name) == []
        assert load_task(name).name == name
        assert load_task(find_task(name)) == load_task(name)


def test_human_shapes_is_a_ring_of_five_shapes_that_fits_its_workspace() -> None:
    task = load_task("human-shapes")
    assert [g.name for g in task.gestemes] == ["GShape", "NShape", "PShape", "JShape", "Snake"]
    state, ring = next(iter(task.start)), []
    for _ in task.states:
        ring.append(task.state(state).gestemes)
        (state,) = task.state(state).next
    assert state == next(iter(task.start))
    assert ring == [("GShape",), ("NShape",), ("PShape",), ("JShape",), ("Snake",)]
    assert task.drawings is not None
    # The chain's extent as drawn, from where it begins: left, right, low, high.
    drawn_m = np.array([[-33.9, -40.6], [75.1, 72.5]]) * 1e-3 * task.drawings.scale
    y = task.robot.tool_start_m[1] - drawn_m[:, 0]
    z = task.robot.tool_start_m[2] + drawn_m[:, 1]
    assert y.mean() == pytest.approx(0, abs=2e-3)
    assert np.ptp(z) == pytest.approx(0.4, abs=2e-3)
    for corner in ((0.6, a, b) for a in y for b in z):
        assert task.workspace.excess_m(corner) == {}


def test_the_lines_through_obstacles_keep_clear_of_them() -> None:
    task = load_task("lines-through-obstacles")
    lines = read_csv(find_task("lines-through-obstacles").with_suffix(".csv"))
    np.testing.assert_allclose(lines.positions[0], task.robot.tool_start_m)
    assert list(dict.fromkeys(lines.states)) == [state.name for state in task.states]
    for begin, end in zip(lines.positions[:-1], lines.positions[1:], strict=True):
        for point in np.linspace(begin, end, 50):
            assert task.workspace.excess_m(tuple(point)) == {}
            for box in task.workspace.obstacles:
                assert box.size_m is not None
                outside = np.abs(point - box.position_m) - np.array(box.size_m) / 2
                assert np.linalg.norm(np.maximum(outside, 0)) > 0.1


# --- one mistake, one line ------------------------------------------------------------------------

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


# --- the model ------------------------------------------------------------------------------------


def test_a_list_of_followers_makes_them_equally_probable(tmp_path: Path) -> None:
    file = tmp_path / "t.yaml"
    file.write_text(GOOD.replace("[fall]", "[fall, rise]"))
    assert load_task(file).states[0].next == {"fall": 0.5, "rise": 0.5}


def test_a_task_made_in_python_is_held_to_the_same_agreements() -> None:
    data = yaml.safe_load(GOOD)
    data["start"] = ["nowhere"]
    with pytest.raises(ValidationError, match="unknown state 'nowhere'"):
        Task.model_validate(data)


def test_a_task_survives_the_way_through_json() -> None:
    task = load_task("human-shapes")
    assert Task.model_validate_json(task.model_dump_json()) == task


@given(st.text(max_size=70))
def test_the_names_of_a_task_are_those_a_key_admits(name: str) -> None:
    try:
        check_name("name", name)
        admitted = True
    except KeyNameError:
        admitted = False
    data = yaml.safe_load(GOOD)
    data["name"] = name
    try:
        Task.model_validate(data)
        taken = True
    except ValidationError:
        taken = False
    assert taken == admitted


@given(st.from_regex(re.compile(r"[A-Za-z0-9._/*$#?@-]{1,66}"), fullmatch=True))
def test_names_that_are_nearly_right_are_judged_as_keys_judge_them(name: str) -> None:
    test_the_names_of_a_task_are_those_a_key_admits.hypothesis.inner_test(name)  # type: ignore[attr-defined]


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


@pytest.mark.parametrize(
    ("shape", "measures", "said"),
    [
        ("box", {}, "a box needs size_m"),
        ("box", {"size_m": (1, 1, 1), "radius_m": 1}, "a box has no radius_m"),
        ("cylinder", {"radius_m": 1}, "a cylinder needs length_m"),
        ("cylinder", {}, "a cylinder needs length_m and radius_m"),
        ("sphere", {"radius_m": 1, "length_m": 1}, "a sphere has no length_m"),
    ],
)
def test_an_obstacle_has_the_measures_of_its_shape(
    shape: str, measures: dict[str, Any], said: str
) -> None:
    data = {"name": "o", "shape": shape, "position_m": (0, 0, 0), **measures}
    with pytest.raises(ValidationError, match=said):
        TypeAdapter(Obstacle).validate_python(data)


@pytest.mark.parametrize(
    ("fixture", "says"),
    [
        ("volume: {knots: [{progress: 0, radius_m: 0.002}]}", "below dead_zone_m"),
        (
            "volume: {knots: [{progress: 0.5, radius_m: 0.1}, {progress: 0.2, radius_m: 0.1}]}",
            "rising",
        ),
        ("compliance: optimal", "no lines"),
        ("law: soft", "general"),
    ],
)
def test_a_fixture_that_cannot_be_is_reported_with_its_line(
    check: Check, fixture: str, says: str
) -> None:
    (problem,) = check(f"{GOOD}fixture:\n  {fixture}\n")
    assert says in problem.message
    assert problem.line >= GOOD.count("\n")


@pytest.mark.parametrize(
    ("fixture", "says"),
    [
        ("shared: {operator_axes: [vx]}", "need a plan"),
        ("plan: {}, shared: {operator_axes: [vx, vx]}", "each once"),
        ("plan: {}, target: {position_m: [0, 0, 0.5]}", "give one of them"),
        ("volume: {knots: []}", "no radius"),
    ],
)
def test_a_states_fixture_that_contradicts_itself_is_reported(
    check: Check, fixture: str, says: str
) -> None:
    text = GOOD.replace("    next: [fall]", f"    next: [fall]\n    fixture: {{{fixture}}}")
    (problem,) = check(text)
    assert says in problem.message
    assert problem.path.startswith("states[0].fixture")


def test_a_state_may_go_by_a_plan_or_to_a_target(check: Check) -> None:
    for fixture in (
        "plan: {speed_m_s: 0.03}, shared: {operator_axes: [vx, wz]}",
        "target: {position_m: [0, 0, 0.5], orientation_xyzw: [0, 0, 0, 1]}",
        "compliance: cue, cue: {cue: pedal, scaling: hold}",
    ):
        text = GOOD.replace("    next: [fall]", f"    next: [fall]\n    fixture: {{{fixture}}}")
        assert check(text) == []


def test_an_axis_both_shared_and_blocked_is_reported(check: Check) -> None:
    shared = "plan: {}, shared: {operator_axes: [vx, wz]}"
    text = GOOD.replace("    next: [fall]", f"    next: [fall]\n    fixture: {{{shared}}}")
    (problem,) = check(f"{text}fixture:\n  axis_scale: [1, 1, 1, 1, 1, 0]\n")
    assert "wz is the operator's" in problem.message
    assert problem.path == "states[0].fixture.shared.operator_axes"


# --- an arm of one's own --------------------------------------------------------------------------


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
