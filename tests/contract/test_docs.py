"""The documents hold what the code does: commands, code, tasks, links, and the contract itself."""

from __future__ import annotations

import ast
import re
import shlex
from pathlib import Path

import pytest
import typer.main
import yaml

from hmcs.bus.contract_page import page
from hmcs.recordings.label_files import HEADER
from hmcs.task import Task
from hmcs.task.parts import State
from hmcs_local.command import app

ROOT = Path(__file__).parents[2]
DOCUMENTS = [
    *sorted(ROOT.glob("*.md")),
    ROOT / "examples/README.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]
NAMES = [str(document.relative_to(ROOT)) for document in DOCUMENTS]
EQUATION = re.compile(r"(?<![\d.])[23]\.\d+(?![\d.])")
README_BYTES = 8_000
"""Who wants to know more follows its links."""
documents = pytest.mark.parametrize("document", DOCUMENTS, ids=NAMES)


def blocks(document: Path, language: str) -> list[str]:
    text = document.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def commands(document: Path) -> list[list[str]]:
    """The `hmcs` commands and services started in its shell blocks, without comments."""
    lines = "\n".join(blocks(document, "sh")).replace("\\\n", " ").splitlines()
    words = [shlex.split(line, comments=True) for line in lines]
    return [
        [word for word in each if not re.fullmatch(r"[A-Z_]+=\S*", word)] for each in words if each
    ]


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_bytes()) <= README_BYTES


def test_the_contract_is_the_one_the_code_speaks() -> None:
    assert (ROOT / "docs" / "contract.md").read_text(encoding="utf-8") == page(), "`make schemas`"


@documents
def test_every_link_to_a_file_leads_to_one(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", text):
        if "://" not in target:
            assert (document.parent / target).exists(), target


@documents
def test_every_file_that_is_named_is_there(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    for name in re.findall(r"`((?:shared|services|tests|deploy)/[\w/.-]+)`", text):
        assert "NAME" in name or (ROOT / name).exists(), name


@documents
def test_every_command_exists_with_the_options_it_is_given(document: Path) -> None:
    known = typer.main.get_command(app)
    for words in commands(document):
        if words[0] != "hmcs":
            continue
        command, rest = known, words[1:]
        while hasattr(command, "commands"):
            assert rest, words
            assert rest[0] in command.commands, words
            command, rest = command.commands[rest[0]], rest[1:]
        options = {
            option for each in command.params for option in (*each.opts, *each.secondary_opts)
        }
        for word in rest:
            if word.startswith("--"):
                assert word.partition("=")[0] in options, words


@documents
def test_every_service_that_is_started_is_one(document: Path) -> None:
    for words in commands(document):
        if words[:2] == ["python", "-m"]:
            module = words[2].replace(".", "/")
            service = words[2].partition(".")[0].removeprefix("hmcs_")
            found = ROOT / "services" / service
            assert (found / f"{module}.py").is_file() or (found / module / "__main__.py").is_file()


@documents
def test_every_python_block_is_python(document: Path) -> None:
    for code in blocks(document, "python"):
        ast.parse(code)


@documents
def test_every_yaml_block_is_a_task_or_a_part_of_one(document: Path) -> None:
    for text in blocks(document, "yaml"):
        data = yaml.safe_load(text)
        if "format" in data:
            Task.model_validate(data)
        for state in data.get("states", ()):
            State.model_validate(state)


def test_every_equation_that_the_code_cites_stands_on_its_page_with_its_place() -> None:
    text = (ROOT / "docs/equations.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([0-9.]+)(?:–([0-9.]+))? \| .*? \| `([^`]+)` \|", text, re.MULTILINE)
    explained = set()
    for first, last, place in rows:
        chapter, begin = first.split(".")
        end = last.split(".")[1] if last else begin
        explained |= {f"{chapter}.{number}" for number in range(int(begin), int(end) + 1)}
        cited = set(EQUATION.findall((ROOT / place).read_text(encoding="utf-8")))
        assert {first, last or first} <= cited, f"{place} does not cite {first}"
    for file in (*ROOT.glob("shared/**/*.py"), *ROOT.glob("services/**/*.py")):
        if "tests" not in file.parts and ".venv" not in file.parts:
            for cited in re.findall(r"\(([23]\.[1-9]\d*)\)", file.read_text(encoding="utf-8")):
                assert cited in explained, f"{file.relative_to(ROOT)} cites ({cited})"


def test_the_device_of_the_how_to_is_a_source() -> None:
    (code,) = blocks(ROOT / "docs" / "how-to" / "own-device.md", "python")
    names: dict[str, object] = {}
    exec(compile(code, "own-device.md", "exec"), names)
    opened = names["open_circling"]
    assert callable(opened)
    source = opened(None, None)
    assert not source.sample(None).dead_man
    assert source.sample(1.0).dead_man


def test_labels_set_afterwards_are_shown_as_they_are_read() -> None:
    text = (ROOT / "docs" / "teach-your-own-task.md").read_text(encoding="utf-8")
    assert f"```\n{','.join(HEADER)}\n" in text
