"""A task as it is in Python: names, followers, obstacles, and the way through JSON."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from hmcs.bus.keys import KeyNameError, check_name
from hmcs.task import Task, load_task
from hmcs.task.parts import Obstacle
from support.task_files import GOOD


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
