"""`hmcs task check` and `hmcs train` refuse the same demonstrations, with exit code 2."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hmcs.motion.demonstrations import Demonstration, write_csv

TASK = """\
format: hmcs-task/1
name: carry
dead_zone_m: 0.008
gestemes: [{name: up}, {name: over}]
states:
  - {name: take, gestemes: [up], next: [bring]}
  - {name: bring, gestemes: [over], next: []}
start: [take]
workspace: {lower_m: [0.45, -0.30, 0.30], upper_m: [0.75, 0.30, 0.70]}
robot:
  model: puma560
  tool_start_m: [0.60, 0.15, 0.40]
  tool_orientation_xyzw: [0, 0, 0, 1]
"""
CORNERS_M = np.array([[0.6, 0.15, 0.4], [0.6, 0.15, 0.6], [0.6, -0.1, 0.6]])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "task.yaml").write_text(TASK)
    share = np.linspace(0, 2, 401)
    for seed in range(2):
        corners = CORNERS_M + np.random.default_rng(seed).normal(0, 0.003, CORNERS_M.shape)
        positions = np.stack([np.interp(share, [0, 1, 2], axis) for axis in corners.T], axis=1)
        states = ("take",) * 200 + ("bring",) * 201
        write_csv(
            tmp_path / f"take-{seed}.csv",
            Demonstration("", np.arange(401) / 100, positions, states),
        )
    return tmp_path


def hmcs(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "hmcs_local.command", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
    )


def train(folder: Path, *more: str) -> subprocess.CompletedProcess[str]:
    files = ("take-0.csv", "take-1.csv")
    return hmcs(folder, "train", "task.yaml", *files, "--output", "m.hmcs", "--no-report", *more)


@pytest.mark.long
def test_good_demonstrations_agree(folder: Path) -> None:
    done = hmcs(folder, "task", "check", "task.yaml", "take-0.csv", "take-1.csv")
    assert done.returncode == 0, done.stderr
    assert done.stdout == "task.yaml: in order: 2 gestemes, 2 states; 2 demonstrations agree\n"


@pytest.mark.long
def test_findings_about_demonstrations_are_printed_and_refuse_nothing(folder: Path) -> None:
    done = hmcs(folder, "task", "check", "task.yaml", "take-0.csv", "take-1.csv", "take-0.csv")
    assert done.returncode == 0, done.stderr
    assert "take-0.csv: the same samples as take-0.csv: left out" in done.stdout
    assert done.stdout.endswith("2 demonstrations agree, apart from the findings above\n")


@pytest.mark.long
def test_both_refuse_what_no_hand_made_and_training_does_it_if_asked_to(folder: Path) -> None:
    file = folder / "take-1.csv"
    lines = file.read_text().splitlines()
    lines[150] = lines[150].split(",")[0] + ",0,0,0,take"
    file.write_text("\n".join(lines) + "\n")
    check = hmcs(folder, "task", "check", "task.yaml", "take-0.csv", "take-1.csv")
    for done in (check, train(folder)):
        assert done.returncode == 2
        assert done.stderr.startswith("hmcs: take-1.csv: at 1.490 s the hand jumps by 0.8")
        assert "Traceback" not in done.stderr
    assert not (folder / "m.hmcs").exists()
    insisted = train(folder, "--accept-implausible")
    assert insisted.returncode == 0, insisted.stderr
    assert "the hand jumps" in insisted.stdout
    assert (folder / "m.hmcs").exists()


@pytest.mark.long
@pytest.mark.parametrize("name", ["/dev/zero", "pipe", ".", "bomb.yaml"])
def test_a_task_that_is_no_task_is_refused_at_once(folder: Path, name: str) -> None:
    subprocess.run(["mkfifo", folder / "pipe"], check=True)
    aliases = "\n".join(
        f"{b}: &{b} [{','.join(f'*{a}' for _ in range(9))}]"
        for a, b in zip("abcdefgh", "bcdefghi", strict=True)
    )
    (folder / "bomb.yaml").write_text(f"a: &a [x,x,x,x,x,x,x,x,x]\n{aliases}\n")
    done = hmcs(folder, "task", "check", name)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
