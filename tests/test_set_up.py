"""How `make` finds the Python it makes .venv with, in a folder where every program is a fake."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
OTHER_PYTHON = """#!/bin/sh
# Answers as a Python does that HMCS does not run on; what it installs is the fake uv.
here=$(dirname "$0")
case "$1 $2" in
  "-c "*) echo 3.10 ;;
  "-m venv") mkdir -p "$3/bin"; cp "$0" "$3/bin/python" ;;
  *install_uv.py*) cp "$FAKES/a-uv" "$here/uv"; echo "$here" >> "$FAKES/uv-installed" ;;
esac
"""


def python_of(version: str) -> str:
    """Return a program that answers as a Python of that version does."""
    return OTHER_PYTHON.replace("echo 3.10", f"echo {version}")


PYTHON_311 = python_of("3.11")
UV = """#!/bin/sh
# As uv does, it prints no path where it is to be quiet.
echo "$UV_PYTHON_DOWNLOADS: $*" >> "$FAKES/uv-called"
case "$1 $2" in
  "python install") [ ! -e "$FAKES/no-network" ] || { echo "no network" >&2; exit 2; } ;;
  "python find") case "$*" in *quiet*) ;; *) echo "$FAKES/downloaded" ;; esac ;;
esac
"""
NEEDED = ("cp", "dirname", "make", "mkdir", "mktemp", "rm", "sh", "touch")

pytestmark = pytest.mark.skipif(shutil.which("make") is None, reason="no make here")


class Machine:
    """A machine whose PATH has fakes and a few real tools; this Makefile is in its folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.bin = folder / "bin"
        self.bin.mkdir()
        (folder / "tmp").mkdir()
        for tool in NEEDED:
            (self.bin / tool).symlink_to(shutil.which(tool) or tool)
        self.has("a-uv", UV, at=folder)
        self.has("downloaded", PYTHON_311, at=folder)
        (folder / "deploy").mkdir()
        for name in ("Makefile", "uv.lock", "pyproject.toml"):
            shutil.copy(ROOT / name, folder)
        for name in ("find_python.sh", "install_uv.py"):
            shutil.copy(ROOT / "deploy" / name, folder / "deploy")

    def has(self, name: str, script: str, at: Path | None = None) -> None:
        """Put a program on PATH."""
        program = (at or self.bin) / name
        program.write_text(script, encoding="utf-8")
        program.chmod(0o755)

    def run(self, *command: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [shutil.which(command[0], path=self.bin) or self.folder / command[0], *command[1:]],
            cwd=self.folder,
            env={
                "PATH": str(self.bin),
                "HOME": str(self.folder),
                "FAKES": str(self.folder),
                "TMPDIR": str(self.folder / "tmp"),
            },
            capture_output=True,
            text=True,
            check=False,
        )

    def find_python(self, *asked: str) -> subprocess.CompletedProcess[str]:
        return self.run("sh", "deploy/find_python.sh", *asked)

    def noted(self, name: str) -> list[str]:
        """What a fake has written down."""
        file = self.folder / name
        return file.read_text(encoding="utf-8").splitlines() if file.exists() else []


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


@pytest.mark.parametrize("asked", [(), ("auto",)])
@pytest.mark.parametrize("name", ["python3.11", "python3", "python"])
def test_a_python_at_hand_is_taken_and_nothing_is_downloaded(
    machine: Machine, asked: tuple[str, ...], name: str
) -> None:
    machine.has("uv", UV)
    machine.has("python3", OTHER_PYTHON)
    machine.has(name, PYTHON_311)
    assert machine.find_python(*asked).stdout == f"{name}\n"
    assert machine.noted("uv-called") == []


@pytest.mark.parametrize(
    ("there", "taken"),
    [
        ({"python3.13": "3.13", "python3.12": "3.12", "python3": "3.11"}, "python3"),
        ({"python3.13": "3.13", "python3": "3.12"}, "python3"),
        ({"python3.13": "3.13", "python3": "3.14"}, "python3.13"),
    ],
)
def test_of_several_the_one_with_both_engines_comes_first_then_the_oldest(
    machine: Machine, there: dict[str, str], taken: str
) -> None:
    for name, version in there.items():
        machine.has(name, python_of(version))
    assert machine.find_python().stdout == f"{taken}\n"


@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13"])
def test_a_version_or_a_program_that_is_named_is_taken(machine: Machine, version: str) -> None:
    machine.has("python3.11", PYTHON_311)
    machine.has("a-python", python_of(version))
    machine.has(f"python{version}", python_of(version))
    assert machine.find_python("a-python").stdout == "a-python\n"
    assert machine.find_python(version).stdout == f"python{version}\n"


def test_a_python_of_pyenv_is_found(machine: Machine) -> None:
    machine.has(
        "python3.13", "#!/bin/sh\necho 'pyenv: python3.13: command not found' >&2; exit 127\n"
    )
    folder = machine.folder / ".pyenv/versions/3.13.0/bin"
    folder.mkdir(parents=True)
    machine.has("python3.13", python_of("3.13"), at=folder)
    assert machine.find_python().stdout == f"{folder / 'python3.13'}\n"


def test_a_version_that_is_not_there_is_refused_though_another_is(machine: Machine) -> None:
    machine.has("python3.11", PYTHON_311)
    done = machine.find_python("3.13")
    assert (done.returncode, done.stdout) == (1, "")
    assert "found no 3.13" in done.stderr


def test_make_makes_the_environment_anew_for_another_python_that_is_named(
    machine: Machine,
) -> None:
    for version in ("3.11", "3.13"):
        machine.has(f"python{version}", python_of(version))

    def made() -> str:
        return machine.run(".venv/bin/python", "-c", "").stdout.strip()

    assert machine.run("make", "setup").returncode == 0
    assert made() == "3.11"
    assert machine.run("make", "setup", "PYTHON=3.13").returncode == 0
    assert made() == "3.13"
    (machine.folder / ".venv/mark").touch()
    for again in ([], ["PYTHON=3.13"], ["PYTHON=auto"]):
        assert machine.run("make", "setup", *again).returncode == 0
    assert (machine.folder / ".venv/mark").exists()


@pytest.mark.parametrize("asked", [(), ("python3",), ("/no/such place/python",)])
def test_without_leave_nothing_is_downloaded_and_one_line_says_how_to_give_it(
    machine: Machine, asked: tuple[str, ...]
) -> None:
    machine.has("uv", UV)
    machine.has("python3", OTHER_PYTHON)
    done = machine.find_python(*asked)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    for reported in (
        *asked,
        "needs CPython 3.11, 3.12 or 3.13",
        "PYTHON=/path/to/python3.11",
        "demo PYTHON=auto",
    ):
        assert reported in done.stderr
    assert machine.noted("uv-called") == []


def test_with_leave_the_uv_on_the_path_downloads_one(machine: Machine) -> None:
    machine.has("uv", UV)
    machine.has("python3", OTHER_PYTHON)
    assert machine.find_python("auto").stdout == f"{machine.folder / 'downloaded'}\n"
    install, find = machine.noted("uv-called")
    assert install.startswith("automatic: python install")
    assert find.startswith("automatic: python find")
    assert install.split()[-1] == find.split()[-1] == "3.11"
    assert machine.noted("uv-installed") == []


@pytest.mark.parametrize("name", ["python3", "python"])
def test_with_leave_and_without_uv_another_python_installs_it_for_the_download_alone(
    machine: Machine, name: str
) -> None:
    machine.has(name, OTHER_PYTHON)
    assert machine.find_python("auto").stdout == f"{machine.folder / 'downloaded'}\n"
    assert len(machine.noted("uv-installed")) == 1
    assert list((machine.folder / "tmp").iterdir()) == []


def _nothing_at_all(_: Machine) -> None:
    pass


def _no_venv(machine: Machine) -> None:
    machine.has("python3", "#!/bin/sh\nexit 1\n")


def _no_network(machine: Machine) -> None:
    machine.has("uv", UV)
    (machine.folder / "no-network").touch()


@pytest.mark.parametrize(
    ("state", "reported"),
    [
        (_nothing_at_all, "could not get uv"),
        (_no_venv, "could not get uv"),
        (_no_network, "could not download it"),
    ],
)
def test_download_that_fails_says_why_and_leaves_nothing(
    machine: Machine, state: Callable[[Machine], None], reported: str
) -> None:
    state(machine)
    done = machine.find_python("auto")
    assert (done.returncode, done.stdout) == (1, "")
    assert reported in done.stderr.splitlines()[-1]
    assert list((machine.folder / "tmp").iterdir()) == []


def test_make_sets_up_with_the_python_that_was_downloaded(machine: Machine) -> None:
    machine.has("uv", UV)
    refused = machine.run("make", "setup")
    assert refused.returncode
    assert "make demo PYTHON=auto" in refused.stderr
    assert not (machine.folder / ".venv").exists()
    done = machine.run("make", "setup", "PYTHON=auto")
    assert done.returncode == 0, done.stderr
    assert (machine.folder / ".venv/.synced").exists()
    sync = machine.noted("uv-called")[-1]
    assert sync.startswith("never: sync --frozen")


def test_uv_is_installed_as_the_lock_file_has_it() -> None:
    spec = importlib.util.spec_from_file_location("install_uv", ROOT / "deploy/install_uv.py")
    assert spec is not None
    assert spec.loader is not None
    install_uv = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(install_uv)
    text = (ROOT / "uv.lock").read_text(encoding="utf-8")
    (uv,) = (each for each in tomllib.loads(text)["package"] if each["name"] == "uv")
    expected = (uv["version"], [wheel["hash"] for wheel in uv["wheels"]])
    assert install_uv.locked_uv(text) == expected
