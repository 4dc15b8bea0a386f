"""What cannot be is refused before anything is read, and never by a traceback."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from hmcs.motion.demonstrations import write_csv
from hmcs_local import entry
from hmcs_local.command import main
from hmcs_trainer import training
from support.lessons import performed

HMCS = [sys.executable, "-m", "hmcs_local.command"]
Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def hmcs(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Run:
    def run(*words: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["hmcs", *map(str, words)])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capfd.readouterr()
        return int(ended.value.code or 0), said.out, said.err

    return run


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--output", "m.hmcs", "--recognizer", "lhm"), "did you mean lhmm?"),
        (("--output", "m.hmcs", "--set", "temperatur=3"), "did you mean temperature?"),
        (("--output", "m.hmcs", "--set", "temperature=hot"), "setting temperature"),
        (("--output", "m.hmcs", "--choose", "temprature=1,2"), "did you mean temperature?"),
        (("--output", "m.hmcs", "--choose", "temperature=1,hot"), "setting temperature"),
        (("--output", "."), "--output .: is a folder: name a file in it"),
        (("--output", "file/m.hmcs"), "--output: file: is no folder"),
        (("--output", "file/deeper/m.hmcs"), "--output: file: is no folder"),
        (("--output", "/dev/full"), "--output /dev/full: is no file"),
    ],
)
def test_training_refuses_what_cannot_be_before_it_reads_anything(
    hmcs: Run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: tuple[str, ...],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("")
    code, out, err = hmcs("train", "human-shapes", "gone.csv", *words, "--no-report")
    assert (code, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("train", "human-shape", "gone.csv", "--output", "m.hmcs"), "human-shapes"),
        (("up", "human-shape"), "human-shapes"),
        (("up", "human-shapes", "--source", "pge"), "page"),
        (("up", "human-shapes", "d.csv", "--recognizer", "lhm"), "lhmm"),
        (("up", "--services", "robt"), "robot"),
        (("up", "--scale", "robt=2"), "robot"),
        (("check", "gone.csv", "--task", "human-shape"), "human-shapes"),
        (("task", "check", "human-shape"), "human-shapes"),
        (("new", "mine", "--robot", "pandda"), "panda"),
        (("robot", "check", "pandda"), "panda"),
        (("recognizers", "lhm"), "lhmm"),
        (("export", "gone", "--to", "made", "--format", "rosbag"), "rosbag2"),
        (("study", "noice"), "noise"),
        (("study", "noise", "--set", "trainig=1"), "training"),
        (("figures", "--only", "4.1"), "4.1"),
        (("tran",), "train"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else value,
)
def test_an_unknown_name_is_answered_with_the_nearest(
    hmcs: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    write_csv(tmp_path / "d.csv", performed(1))
    code, out, err = hmcs(*words)
    assert (code, out) == (2, "")
    assert "did you mean" in err.lower()
    assert said in err.lower().partition("did you mean")[2]
    assert "Traceback" not in err


def test_a_file_where_the_folder_of_the_stack_should_be_is_named(hmcs: Run, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    code, _, err = hmcs("up", "--folder", tmp_path / "file")
    assert code == 2
    assert str(tmp_path / "file") in err
    assert "Traceback" not in err


@pytest.mark.parametrize("words", [("--help",), ("check", "d.csv")])
def test_a_full_disk_is_reported_in_one_line(tmp_path: Path, words: tuple[str, ...]) -> None:
    write_csv(tmp_path / "d.csv", performed(1))
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*HMCS, *words],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
            check=False,
        )
    assert done.returncode == 1
    assert done.stderr == "hmcs: cannot write its output: No space left on device\n"


@pytest.mark.parametrize(
    "environment",
    [
        {"PYTHONIOENCODING": "ascii"},
        {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"},
    ],
)
def test_a_terminal_of_ascii_shows_everything(tmp_path: Path, environment: dict[str, str]) -> None:
    write_csv(tmp_path / "dä.csv", performed(1))
    for words in (("check", "dä.csv"), ("--help",)):
        done = subprocess.run(
            [*HMCS, *words],
            capture_output=True,
            cwd=tmp_path,
            env=os.environ | environment,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert done.stdout.isascii()
        assert not done.stderr


def test_an_interrupt_while_the_command_is_loaded_ends_it_without_a_word(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setitem(sys.modules, "hmcs_local.command", SimpleNamespace(main=interrupted))
    with pytest.raises(SystemExit) as ended:
        entry.main()
    assert ended.value.code == 130
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("module", ["typer", "rich.text", "pydantic", "numpy", "hmcs_trainer"])
def test_an_interrupt_at_any_import_leaves_no_traceback(module: str) -> None:
    interrupts = f"""
import os, signal, sys

class Finder:
    def find_spec(name, path, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Finder)
sys.argv = ["hmcs", "task", "check", "human-shapes"]
from hmcs_local.entry import main
main()
"""
    done = subprocess.run(
        [sys.executable, "-c", interrupts], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_what_takes_the_interrupt_is_loaded_before_anything_else() -> None:
    listed = "import hmcs_local.entry, sys; print('typer' in sys.modules, 'hmcs' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", listed], capture_output=True, text=True, check=True
    )
    assert done.stdout == "False False\n"


def test_the_version_and_completion_are_shown(hmcs: Run) -> None:
    assert hmcs("--version")[:2] == (0, "hmcs 0.1.0\n")
    asked = {"_HMCS_COMPLETE": "complete_bash", "COMP_WORDS": "hmcs seg", "COMP_CWORD": "1"}
    done = subprocess.run(HMCS, capture_output=True, text=True, check=False, env=os.environ | asked)
    assert done.stdout.split() == ["segment"]
    assert "--install-completion" in hmcs("--help")[1]


def test_what_is_asked_of_the_stack_is_checked_before_anything_is_learned(
    hmcs: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(training, "train", lambda *_, **__: pytest.fail("it learned"))
    write_csv(tmp_path / "d.csv", performed(1))
    for words in (("--services", "nobody"), ("--scale", "nobody=2"), ("--source", "nobody")):
        code, _, err = hmcs("up", "human-shapes", "d.csv", *words)
        assert code == 2
        assert "'nobody'" in err
