"""What every command promises, tried on all commands of the parser.

A command that is added is tried too: where it needs an argument of its own, `GIVEN` says what.
"""

from __future__ import annotations

import builtins
import io
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from hmcs.recognition.learning import learn
from hmcs.recognition.model_file import save_model
from hmcs_local.command import app, main
from hmcs_secure.authority import create_authority, issue, utc_now
from hmcs_secure.identity import ROUTER, Identity
from support.commands import Command, Parameter, commands_of
from support.lessons import lesson_task, performed

Run = Callable[..., tuple[int, str, str]]

COMMANDS = tuple(commands_of(app))
ELSEWHERE = ("secure router --files",)
"""Names a place in a container."""
FILE_OR_FOLDER = ("segment --out", "import --to")


def options_of_paths() -> Iterator[tuple[Command, Parameter]]:
    for command in COMMANDS:
        for parameter in command.parameters:
            words = " ".join((*command.words, parameter.option))
            if parameter.option and parameter.is_path and words not in ELSEWHERE:
                yield command, parameter


OPTIONS = {
    " ".join((*command.words, option.option)): (command, option)
    for command, option in options_of_paths()
}
FOLDERS = [name for name, (_, each) in OPTIONS.items() if each.metavar in ("DIR", "FOLDER")]
FILES = [name for name in OPTIONS if name not in (*FOLDERS, *FILE_OR_FOLDER)]


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model, and a closed cell."""
    folder = tmp_path_factory.mktemp("kept")
    save_model(learn(lesson_task(), [performed(seed) for seed in (1, 2)]), folder / "good.hmcs")
    authority = create_authority(folder / "secure" / "gone", "gone", utc_now())
    issue(authority, Identity("gone", ROUTER), utc_now())
    return folder


@pytest.fixture
def place(kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder: with a model, a closed cell and a file."""
    for each in kept.iterdir():
        (tmp_path / each.name).symlink_to(each)
    (tmp_path / "file").write_text("")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HMCS_ROUTER", "tcp/127.0.0.1:1")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path


@pytest.fixture
def hmcs(place: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Run:
    """Run a command in this process, in `place`."""

    def run(words: list[str]) -> tuple[int, str, str]:
        assert Path.cwd() == place
        monkeypatch.setattr(sys, "argv", ["hmcs", *words])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capfd.readouterr()
        return int(ended.value.code or 0), said.out, said.err

    return run


def refused(run: Run, option: str, value: str) -> None:
    command, parameter = OPTIONS[option]
    code, out, err = run(command.with_option(parameter.option, value))
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert value.partition("/")[0] in err or parameter.option in err
    assert "gone." not in err, "the data were looked for before"


@pytest.mark.parametrize("option", OPTIONS)
def test_a_place_below_a_file_is_refused_before_anything_is_read(
    hmcs: Run, place: Path, option: str
) -> None:
    before = sorted(place.rglob("*"))
    refused(hmcs, option, "file/below")
    assert sorted(place.rglob("*")) == before


@pytest.mark.parametrize("option", FILES)
def test_a_folder_where_a_file_should_be_is_refused(hmcs: Run, option: str) -> None:
    refused(hmcs, option, ".")


@pytest.mark.parametrize("option", FOLDERS)
def test_a_file_where_a_folder_should_be_is_refused(hmcs: Run, place: Path, option: str) -> None:
    refused(hmcs, option, "file")
    assert (place / "file").read_text() == ""


@pytest.mark.parametrize("words", [command.words for command in COMMANDS], ids=" ".join)
def test_help_on_a_full_disk_is_one_message(
    hmcs: Run, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    with Path("/dev/full").open("w") as full:
        monkeypatch.setattr(sys, "stdout", full)
        code, _, err = hmcs([*words, "--help"])
    assert (code, err) == (1, "hmcs: cannot write its output: No space left on device\n")


@pytest.mark.parametrize("words", [command.words for command in COMMANDS], ids=" ".join)
def test_a_terminal_of_ascii_shows_the_help_of_every_command(
    hmcs: Run, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    shown = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(shown, encoding="ascii", errors="strict"))
    code, _, err = hmcs([*words, "--help"])
    assert (code, err) == (0, "")
    assert b"Usage: hmcs " + " ".join(words).encode() in shown.getvalue()


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: " ".join(command.words))
def test_an_interrupt_while_a_command_loads_what_it_needs_ends_it_without_a_word(
    hmcs: Run, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    load, interrupted = builtins.__import__, []

    def interrupts(name: str, namespace: Any = None, *rest: Any) -> Any:
        if str((namespace or {}).get("__name__")).startswith("hmcs_"):
            interrupted.append(name)
            raise KeyboardInterrupt
        return load(name, namespace, *rest)

    monkeypatch.setattr(builtins, "__import__", interrupts)
    code, out, err = hmcs(command.with_option())
    monkeypatch.undo()
    if interrupted:
        assert (code, out, err) == (130, "", "")
