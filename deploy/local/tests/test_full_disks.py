"""A disk that is full when a command writes its file: one message that names the file."""

from __future__ import annotations

import resource
import sys
from pathlib import Path

import pytest

from hmcs.motion.demonstrations import write_csv
from hmcs_local.command import main
from support.lessons import performed
from support.recordings import Maker, hand_of


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """With a recording and a demonstration."""
    Maker(tmp_path).write(list(hand_of(("lift", "carry"), 100)))
    write_csv(tmp_path / "d.csv", performed(1))
    return tmp_path


@pytest.mark.parametrize(
    ("command", "file"),
    [
        ("new mine", "mine.yaml"),
        ("label take --set 0.1-0.3=lift", "take.labels.csv"),
        ("export take --to tables", "tables"),
        ("import d.csv --to made.csv", "made.csv"),
        ("robot check puma560 --output arm.svg", "arm.svg"),
        ("secure init cell", "cell"),
        ("train human-shapes lasa:GShape/1 lasa:NShape/1 lasa:PShape/1 lasa:JShape/1 lasa:Snake/1 "
         "--no-report --output made.hmcs", "made.hmcs"),
    ],
)  # fmt: skip
def test_a_file_that_finds_no_room_is_named_and_nothing_of_it_is_left(
    place: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: str,
    file: str,
) -> None:
    monkeypatch.chdir(place)
    monkeypatch.setattr(sys, "argv", ["hmcs", *command.split()])
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    before = {each for each in place.rglob("*") if each.is_file()}
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    # No file may grow: what is written fails as on a full disk.
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, hard))
    try:
        with pytest.raises(SystemExit) as ended:
            main()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert ended.value.code in (1, 2)
    err = capsys.readouterr().err
    (message,) = (line for line in err.splitlines() if line.startswith("hmcs: "))
    assert file in message
    assert "too large" in message
    assert "Traceback" not in err
    assert {each for each in place.rglob("*") if each.is_file()} == before
