"""`hmcs` outside of the repository, installed from the wheels of all distributions."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
UV = Path(sys.executable).with_name("uv")


def distributions() -> set[str]:
    """The names of all distributions of the repository, as wheels bear them."""
    manifests = [
        tomllib.loads(path.read_text(encoding="utf-8"))
        for folder in ("shared", "services", "deploy")
        for path in (ROOT / folder).rglob("pyproject.toml")
    ]
    return {each["project"]["name"].replace("-", "_") for each in manifests}


def run(*command: str | Path, cwd: Path, **environment: str) -> str:
    """Run a program without the settings of this environment; fail with its output."""
    settings = ("HMCS_", "PYTHONPATH", "VIRTUAL_ENV", "UV_PROJECT_ENVIRONMENT")
    own = {name: value for name, value in os.environ.items() if not name.startswith(settings)}
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env={**own, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        pytest.fail(f"{command} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel of every distribution."""
    folder = tmp_path_factory.mktemp("wheels")
    words = ("--all-packages", "--wheel", "--python", sys.executable, "--out-dir", folder)
    run(UV, "build", *words, cwd=ROOT)
    return folder


@pytest.fixture(scope="module")
def hmcs(wheels: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The command as `uv tool install` makes it of the wheels, with what the lock file names."""
    folder = tmp_path_factory.mktemp("tools")
    locked = folder / "locked.txt"
    words = ("--frozen", "--no-emit-workspace", "--no-hashes", "--no-dev", "--output-file", locked)
    run(UV, "export", *words, cwd=ROOT)
    run(
        *(UV, "tool", "install", "--python", sys.executable, "--find-links", wheels),
        *("--constraints", locked, "--with", "hmcs-demo", "hmcs-local"),
        cwd=folder,
        UV_TOOL_DIR=str(folder / "tools"),
        UV_TOOL_BIN_DIR=str(folder / "bin"),
    )
    return folder / "bin" / "hmcs"


def test_every_distribution_makes_a_wheel_that_tells_its_types(wheels: Path) -> None:
    typed = set()
    for wheel in wheels.glob("*.whl"):
        names = zipfile.ZipFile(wheel).namelist()
        typed |= {wheel.name.split("-")[0]} if any("/py.typed" in name for name in names) else set()
    assert typed == distributions()


def test_stack_and_tasks_travel_inside_the_wheels_as_they_stand_in_the_repository(
    wheels: Path,
) -> None:
    (launcher,) = wheels.glob("hmcs_local-*.whl")
    inside = zipfile.ZipFile(launcher).read("hmcs_local/compose.yaml")
    assert inside == (ROOT / "compose.yaml").read_bytes()
    (shared,) = wheels.glob("hmcs-*.whl")
    names = zipfile.ZipFile(shared).namelist()
    tasks = {path.name for path in (ROOT / "shared/hmcs/tasks").iterdir() if path.is_file()}
    assert {Path(name).name for name in names if name.startswith("hmcs/tasks/")} == tasks


def test_installed_command_knows_shipped_tasks_and_the_demo_in_an_empty_folder(
    hmcs: Path, tmp_path: Path
) -> None:
    assert "human-shapes: in order" in run(hmcs, "task", "check", "human-shapes", cwd=tmp_path)
    assert "--held-out" in run(hmcs, "demo", "--help", cwd=tmp_path, COLUMNS="200", NO_COLOR="1")
    assert list(tmp_path.iterdir()) == []


def test_installed_demo_writes_its_report_in_an_empty_folder(hmcs: Path, tmp_path: Path) -> None:
    said = run(hmcs, "demo", cwd=tmp_path)
    report = tmp_path / "out" / "demo"
    assert str(report / "index.html") in said.replace("\n", "")
    assert (report / "index.html").is_file()
    assert json.loads((report / "summary.json").read_text(encoding="utf-8"))["steps"] > 100
