"""Task files made to do harm are refused: in time, in memory, and with the line that does it."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from hmcs.task import TaskFileError, load_task
from hmcs.task.file import LONGEST_MESSAGE, MOST_BYTES, MOST_TOLD
from hmcs.task.yaml_lines import DEEPEST, LONGEST_NUMBER, MOST_NODES, YamlError, read_yaml
from support.task_files import Check

HEAD = """\
format: hmcs-task/1
name: small
dead_zone_m: 0.01
"""
TAIL = """\
start: [s0]
workspace: {lower_m: [-1, -1, 0], upper_m: [1, 1, 1]}
robot: {model: puma560, tool_start_m: [0, 0, 0.5], tool_orientation_xyzw: [0, 0, 0, 1]}
"""
LETTERS = "abcdefghi"


def task_of(states: int, following: Callable[[int], list[str]]) -> str:
    gestemes = "".join(f"  - {{name: g{k}}}\n" for k in range(states))
    rows = "".join(
        f"  - {{name: s{k}, gestemes: [g{k}], next: [{', '.join(following(k))}]}}\n"
        for k in range(states)
    )
    return f"{HEAD}gestemes:\n{gestemes}states:\n{rows}{TAIL}"


RING = task_of(3, lambda k: [f"s{(k + 1) % 3}"])


def multiplied(first: str, entry: str) -> str:
    """Nine values, nine of those, and so on: each line stands for nine times the one before."""
    lines = [f"a: &a {first}"]
    for inner, outer in pairwise(LETTERS):
        aliases = ",".join(f"*{inner}" for _ in range(9))
        lines.append(f"{outer}: &{outer} {entry.format(aliases)}")
    return "\n".join(lines)


HOSTILE = {
    "aliases of aliases": (multiplied("[x,x,x,x,x,x,x,x,x]", "[{}]"), 5, "more than 10,000 values"),
    "merged mappings of mappings": (multiplied("{x: 1}", "{{<<: [{}]}}"), 5, "more than 10,000"),
    "an alias as a key": ("a: &a [x]\n? *a\n: 1", 1, "a key that is a list"),
    "many values": ("\n".join(f"k{k}: 1" for k in range(10_000)), 5_000, "more than 10,000"),
    "deep lists": ("[" * 5_000, 1, f"more than {DEEPEST} levels"),
    "deep mappings": ("{a: " * 5_000, 1, "levels"),
    "deep blocks": ("- " * 5_000, 1, "levels"),
    "deep keys": ("? " * 5_000, 1, "levels"),
    "a long integer": ("a: 1\nb: " + "9" * 200_000, 2, "a number of 200,000 characters"),
    "a long integer of base 60": ("a: " + ":".join("1" * 50_000), 1, "a number of 99,999"),
    "a long float": ("a: 1." + "0" * 5_000, 1, "a number of"),
    "an integer without digits": ("a: 1\nb: 0b_", 2, "is no number"),
    "a call": ("!!python/object/apply:os.system ['exit 7']", 1, "tag"),
    "bytes": ("a: !!binary 'x'", 1, "tag"),
    "a date that is none": ("a: !!timestamp x", 1, "tag"),
    "a set": ("a: 1\nb: !!set {x, y}", 2, "tag"),
    "a tag of one's own": ("a: !mine x", 1, "tag"),
    "a text that is called an integer": ("a: !!int x", 1, "tag"),
    "a value within itself": ("a: &a {b: [*a]}", 1, "holds itself"),
    "merging with itself": ("a: &a {<<: *a}", 1, "holds itself"),
    "merging with a number": ("a: {<<: 5}", 1, "not YAML"),
    "a null byte": ("a: 1\nb: \0", 2, "not YAML text"),
    "half a surrogate pair": ('a: 1\nb: "\\ud800"', 2, "not YAML text"),
    "another YAML": ("%YAML 9.9\n---\na: 1", 1, "not YAML"),
    "a large file": ("# nothing\n" * 30_000, 1, f"larger than {MOST_BYTES:,} bytes"),
}


@pytest.mark.parametrize(("text", "line", "says"), HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_file_is_refused_at_its_line(
    check: Check, text: str, line: int, says: str
) -> None:
    (problem,) = check(text)
    assert says in problem.message
    assert problem.line == line


def test_a_key_is_text_whatever_it_looks_like() -> None:
    text = "on: 1\n2: 2\nnull: 3\n.nan: 4\n2001-13-45: 5\n=: 6"
    keys = ["on", "2", "null", ".nan", "2001-13-45", "="]
    document = read_yaml(text)
    assert list(document.data) == keys
    assert [document.lines[key,] for key in keys] == [1, 2, 3, 4, 5, 6]


def test_what_looks_like_a_date_is_text() -> None:
    assert read_yaml("a: 2001-01-01").data == {"a": "2001-01-01"}


def test_a_mapping_merged_into_another_is_read() -> None:
    assert read_yaml("a: &a {x: 1, y: 2}\nb: {<<: *a, y: 3}").data["b"] == {"x": 1, "y": 3}


def test_the_bounds_are_reached_and_not_passed() -> None:
    most = MOST_NODES // 2
    assert len(read_yaml("".join(f"- &a{k}\n- x\n" for k in range(most - 1))).data) == 2 * most - 2
    assert read_yaml("[" * DEEPEST + "]" * DEEPEST).data is not None
    assert read_yaml("a: " + "9" * LONGEST_NUMBER).data == {"a": int("9" * LONGEST_NUMBER)}
    for text in ("- x\n" * MOST_NODES, "[" * (DEEPEST + 1), "a: " + "9" * (LONGEST_NUMBER + 1)):
        with pytest.raises(YamlError):
            read_yaml(text)


def test_no_more_mistakes_are_reported_than_are_mended_at_once(check: Check) -> None:
    problems = check(HEAD + "".join(f"k{k}: 1\n" for k in range(4_000)))
    assert len(problems) == MOST_TOLD + 1
    assert "there are more" in problems[-1].message


def test_many_unknown_names_among_many_are_reported_in_part(check: Check) -> None:
    problems = check(task_of(400, lambda _: [f"none{k}" for k in range(10)]))
    assert len(problems) == MOST_TOLD
    assert max(len(problem.message) for problem in problems) == LONGEST_MESSAGE


def test_a_list_of_many_names_is_counted_once(check: Check) -> None:
    (problem,) = check(RING.replace("[s1]", f"[{', '.join('s1' for _ in range(9_000))}]"))
    assert "s1 stands twice" in problem.message


@pytest.mark.parametrize("file", ["a\\0b", "circle/part.stl"])
def test_a_mesh_whose_name_is_no_path_is_a_mistake_with_its_field(
    tmp_path: Path, file: str
) -> None:
    (tmp_path / "circle").symlink_to("circle")
    region = f'{{name: m, shape: mesh, position_m: [0, 0, 0], file: "{file}"}}'
    text = RING.replace("upper_m: [1, 1, 1]", f"upper_m: [1, 1, 1], forbidden: [{region}]")
    (tmp_path / "task.yaml").write_text(text)
    with pytest.raises(TaskFileError, match=r"workspace.forbidden\[0\].file: .*cannot be a path"):
        load_task(tmp_path / "task.yaml")


@pytest.mark.parametrize("place", ["/dev/zero", "pipe", ".", "a\0b", "x" * 5_000, "circle"])
def test_what_is_no_file_is_refused_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    Path("circle").symlink_to("circle")
    with pytest.raises(TaskFileError, match="expected a task file or one of the shipped tasks"):
        load_task(place)


def test_the_worst_file_takes_no_more_memory_than_a_task_needs(tmp_path: Path) -> None:
    # In a process of its own, which may not have more.
    file = tmp_path / "bomb.yaml"
    file.write_text(multiplied("[x,x,x,x,x,x,x,x,x]", "[{}]"))
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            f"from hmcs.task import check_task; print(check_task({str(file)!r}))",
        ],
        preexec_fn=_two_gigabytes,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert "more than 10,000 values" in done.stdout, done.stderr


def _two_gigabytes(*_: Any) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))
