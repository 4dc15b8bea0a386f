"""The rules of the house, kept by tools: imports, format, types, lock file, places of things."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parent.parent
TOOLS = Path(sys.executable).parent
PACKAGES = sorted(
    [
        ROOT / "shared/hmcs",
        ROOT / "shared/baselines/hmcs_baselines",
        *ROOT.glob("deploy/*/hmcs_*"),
        *ROOT.glob("services/*/hmcs_*"),
    ]
)
FORBIDDEN_MODULES = {"pickle", "_pickle", "cPickle", "dill", "cloudpickle", "shelve"}


def run(*command: str | Path, **environment: str) -> str:
    """Run a tool at the root; fail with what it printed unless it exits with 0."""
    done = subprocess.run(
        [str(word) for word in command],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        pytest.fail(f"{command[0]} found:\n{done.stdout}{done.stderr}", pytrace=False)
    return done.stdout


def sources() -> list[Path]:
    """Every Python file of the project."""
    folders = ("shared", "services", "deploy", "examples", "tests")
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def stack_services() -> dict[str, dict[str, object]]:
    services = yaml.safe_load((ROOT / "compose.yaml").read_text(encoding="utf-8"))["services"]
    assert isinstance(services, dict)
    return services


def test_imports_keep_to_the_contracts() -> None:
    run(TOOLS / "lint-imports", "--no-cache", "--config", "pyproject.toml")


def test_every_package_is_under_the_import_contracts() -> None:
    manifest = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert set(manifest["tool"]["importlinter"]["root_packages"]) == {p.name for p in PACKAGES}


def test_code_has_no_lint() -> None:
    run(TOOLS / "ruff", "check", "--no-cache", ".")


def test_code_has_the_house_format() -> None:
    run(TOOLS / "ruff", "format", "--no-cache", "--check", ".")


def test_types_are_strictly_right_in_every_package() -> None:
    run(
        sys.executable,
        *("-W", "ignore", "-m", "mypy"),
        *(word for package in PACKAGES for word in ("-p", package.name)),
        MYPYPATH=os.pathsep.join(str(package.parent) for package in PACKAGES),
    )


def test_lock_file_fits_the_manifests() -> None:
    # What is locked is compared with what is asked for; no index is needed for that.
    run(TOOLS / "uv", "lock", "--check", "--offline", "--quiet")


def test_nothing_is_pickled() -> None:
    found = []
    for path in sources():
        for node in ast.walk(ast.parse(path.read_bytes(), str(path))):
            names: list[str] = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            elif isinstance(node, ast.keyword) and node.arg == "allow_pickle":
                allowed = not (isinstance(node.value, ast.Constant) and node.value.value is False)
                names = ["pickle"] if allowed else []
            if any(name.partition(".")[0] in FORBIDDEN_MODULES for name in names):
                found.append(f"{path.relative_to(ROOT)}: {', '.join(names)}")
    assert not found


@pytest.mark.parametrize("folder", sorted(p.name for p in (ROOT / "services").iterdir()))
def test_every_service_folder_is_laid_out_alike(folder: str) -> None:
    service = ROOT / "services" / folder
    package = service / f"hmcs_{folder}"
    expected = [service / "pyproject.toml", service / "tests", package / "__init__.py"]
    if not folder.startswith("robot_"):  # an engine, which the robot's process loads
        expected += [package / "__main__.py"]
    spec = stack_services().get(folder.replace("_", "-"))
    if spec is not None:  # one that lives on the bus, not a tool such as the trainer
        expected += [package / "settings.py", package / "service.py"]
    assert [path for path in expected if not path.exists()] == []


def test_every_service_of_the_stack_runs_its_own_package_from_its_own_image() -> None:
    targets = re.findall(
        r"^FROM \S+ AS (\S+)$", (ROOT / "deploy/Dockerfile").read_text(encoding="utf-8"), re.M
    )
    for name, spec in stack_services().items():
        build = spec["build"]
        assert isinstance(build, dict)
        target = str(build["target"])
        if name == "router":
            assert {"router", "zenohd"} <= set(targets)
            continue
        assert target in targets, name
        command = spec["command"]
        assert isinstance(command, list)
        assert command[:3] == ["python", "-m", f"hmcs_{target.replace('-', '_')}"], name


@pytest.mark.skipif(shutil.which("make") is None, reason="no make here")
def test_make_alone_lists_every_target() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    phony = re.search(r"^\.PHONY: (.*)$", makefile, re.M)
    assert phony is not None
    listed = re.findall(r"^  make (\S+) +\S", run("make", "--no-print-directory"), re.M)
    assert sorted(listed) == sorted(phony[1].split())
