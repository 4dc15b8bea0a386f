"""`hmcs check`: a table at any width, what to do, and an exit code."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console

from hmcs.motion.demonstrations import write_csv
from hmcs_local.checking import show_check
from support.lessons import performed


@pytest.fixture
def files(tmp_path: Path) -> list[str]:
    shown = performed(1)
    write_csv(tmp_path / "sound.csv", shown)
    write_csv(tmp_path / "mm.csv", shown._replace(positions=1000 * shown.positions))
    return [str(tmp_path / "sound.csv"), str(tmp_path / "mm.csv")]


def test_the_exit_code_is_2_where_one_would_be_refused(files: list[str]) -> None:
    def check(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "hmcs_local.command", "check", *words]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    assert check(files[0]).returncode == 0
    done = check(*files)
    assert done.returncode == 2
    assert "are they in millimeters? Give meters" in done.stdout
    assert not done.stderr


@pytest.mark.parametrize("width", [40, 60, 80, 120, 200])
@pytest.mark.parametrize("looked_at", [False, True])
def test_nothing_is_cut_off_at_any_width(
    files: list[str], width: int, looked_at: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    console = Console(width=width, force_terminal=looked_at, color_system=None)
    assert not show_check(files, "", console)
    out = capsys.readouterr().out
    assert "\x1b" not in out
    for word in ("sound.csv", "mm?, s", "0.28 × 0.21", "reach", "turn-back"):
        assert word in out
    table = out.partition("they lie between")[0]
    assert all(len(line.rstrip()) <= width for line in table.splitlines())
