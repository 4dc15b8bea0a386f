"""`hmcs view`: what is written for Rerun, and what is refused in one line."""

from __future__ import annotations

import lzma
import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from rerun.chunk import RrdReader
from rich.console import Console

from hmcs.errors import UserError
from hmcs_local.commands.recordings import view
from hmcs_local.viewing import save_for_rerun, show_in_rerun

KEPT = Path(__file__).parents[3] / "shared/tests/recordings/kept/reach-and-lift.mcap.xz"
SMALL_DISK_BYTES = 20_000


def hmcs(*words: str | Path, disk_bytes: int = -1) -> subprocess.CompletedProcess[str]:
    """Run the command on a machine without a display, with so much room for a file."""
    environment = {k: v for k, v in os.environ.items() if not k.endswith("DISPLAY")}
    return subprocess.run(
        [sys.executable, "-m", "hmcs_local.command", "view", *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (disk_bytes, disk_bytes)),
    )


@pytest.fixture
def take(tmp_path: Path) -> Path:
    file = tmp_path / "take.mcap"
    file.write_bytes(lzma.decompress(KEPT.read_bytes()))
    return file


def test_a_recording_is_written_for_rerun_with_what_cannot_be_shown_said(take: Path) -> None:
    target = take.parent / "new" / "take.rrd"
    done = hmcs(take, "--rerun", "--save", target)
    assert done.returncode == 0, done.stderr
    assert "made-up: the recording does not say how it looks" in done.stdout
    shown = {c.entity_path for c in RrdReader(target).store().stream().to_chunks()}
    assert {"/base/path", "/operator/path", "/fixture/factor", "/states/fixture"} <= shown
    assert "/beliefs/kept/reach" in shown
    assert RrdReader(target).blueprints()


def test_without_a_display_the_remedy_is_named(take: Path) -> None:
    done = hmcs(take, "--rerun")
    assert (done.returncode, done.stdout) == (2, "")
    assert "no display here: write a file, --save take.rrd" in done.stderr


def test_a_full_disk_leaves_nothing_behind(take: Path) -> None:
    target = take.with_suffix(".rrd")
    done = hmcs(take, "--rerun", "--save", target, disk_bytes=SMALL_DISK_BYTES)
    assert done.returncode == 2
    assert "take.rrd: cannot be written" in done.stderr.splitlines()[-1]
    assert list(take.parent.iterdir()) == [take]


@pytest.mark.parametrize(
    ("options", "remedy"),
    [
        ({}, "name a viewer: --rerun"),
        ({"rerun": True, "save": Path("take.csv")}, "end in .rrd"),
        ({"rerun": True, "save": Path("/dev/null/take.rrd")}, "name another place"),
    ],
)
def test_what_is_asked_wrongly_is_refused_with_what_to_do(
    take: Path, options: dict[str, Any], remedy: str
) -> None:
    with pytest.raises(UserError, match=remedy):
        view(take, **options)


def test_without_the_extra_it_is_named(take: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(UserError, match=r"pip install 'hmcs\[rerun\]'"):
        save_for_rerun(take, take.with_suffix(".rrd"), Console())
    with pytest.raises(UserError, match=r"pip install 'hmcs\[rerun\]'"):
        show_in_rerun(take, Console())
    assert list(take.parent.iterdir()) == [take]
