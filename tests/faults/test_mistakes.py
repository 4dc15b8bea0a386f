"""A user's mistake: exit code 2, one clear message, no traceback."""

from __future__ import annotations

import json
import shutil
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml

from hmcs.task.file import find_task
from hmcs_local.stack import with_free_port
from support.stack import Stack, run_to_end

SERVICES = ("input_device", "gesteme_classifier", "task_hmm", "fixture_controller", "robot")
READS_MODEL = ("gesteme_classifier", "task_hmm", "fixture_controller")
READS_TASK = ("input_device", "robot")


@pytest.fixture(scope="module")
def router(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with Stack(tmp_path_factory.mktemp("logs")) as stack:
        stack.open_bus("observer", "o")
        yield stack.endpoint


def flags_of(service: str, model: Path | str) -> list[str]:
    """Return what a service cannot do without."""
    if service == "fixture_controller":
        return ["--models", json.dumps([str(model)])]
    return ["--model", str(model)] if service in READS_MODEL else []


def refuses(*command: str, saying: str) -> None:
    """Run a process to its end: exit code 2, and one line that says so."""
    done = run_to_end(command)
    reported = [line for line in done.stderr.splitlines() if not line.startswith(("{", "pybullet"))]
    assert done.returncode == 2, f"exit code {done.returncode}: {done.stderr}"
    assert "Traceback" not in done.stdout + done.stderr
    assert len(reported) == 1, reported
    assert saying in reported[0]


def truncated(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-200])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def of_another_version(path: Path) -> None:
    rewritten(path, lambda name, data: data.replace(b"hmcs-model/1", b"hmcs-model/7"))


def with_nan(path: Path) -> None:
    def change(name: str, data: bytes) -> bytes:
        if name != "arrays/parameters.means.npy":
            return data
        header = len(data) - 8
        return data[:header] + np.array([np.nan]).tobytes()

    rewritten(path, change)


def changed_by_hand(path: Path) -> None:
    rewritten(path, lambda _, data: data.replace(b"Five human-drawn", b"Four human-drawn"))


def rewritten(path: Path, change: Callable[[str, bytes], bytes]) -> None:
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in parts.items():
            archive.writestr(name, change(name, data))


@pytest.mark.parametrize(
    ("service", "spoil", "saying"),
    [
        ("gesteme_classifier", truncated, "truncated"),
        ("gesteme_classifier", empty, "truncated"),
        (
            "gesteme_classifier",
            of_another_version,
            "format 'hmcs-model/7', expected 'hmcs-model/1'",
        ),
        ("gesteme_classifier", with_nan, "not finite"),
        ("gesteme_classifier", changed_by_hand, "checksum"),
        ("task_hmm", truncated, "truncated"),
        ("fixture_controller", truncated, "truncated"),
    ],
    ids=lambda value: getattr(value, "__name__", str(value)[:20]),
)
def test_a_spoiled_model_file(
    router: str,
    model_file: Path,
    tmp_path: Path,
    service: str,
    spoil: Callable[[Path], None],
    saying: str,
) -> None:
    path = tmp_path / "spoiled.hmcs"
    shutil.copy(model_file, path)
    spoil(path)
    refuses(f"hmcs_{service}", "--router", router, *flags_of(service, path), saying=saying)


@pytest.mark.parametrize("service", READS_MODEL)
def test_a_model_file_that_is_not_there(router: str, service: str) -> None:
    flags = flags_of(service, "/nowhere/at-all.hmcs")
    refuses(f"hmcs_{service}", "--router", router, *flags, saying="no such model file")


@pytest.mark.parametrize("service", READS_TASK)
def test_a_malformed_task(router: str, tmp_path: Path, service: str) -> None:
    path = tmp_path / "task.yaml"
    lines = find_task("human-shapes").read_text(encoding="utf-8").splitlines()
    line = next(k for k, text in enumerate(lines) if text.startswith("dead_zone_m"))
    lines[line] = "dead_zone_m: -1"
    path.write_text("\n".join(lines), encoding="utf-8")
    flags = ("--router", router, "--task", str(path))
    refuses(f"hmcs_{service}", *flags, saying=f"{path}:{line + 1}: dead_zone_m")


def test_a_pose_the_robot_cannot_reach(router: str, tmp_path: Path) -> None:
    task = yaml.safe_load(find_task("human-shapes").read_text(encoding="utf-8"))
    task["workspace"] = {"lower_m": [-9, -9, -9], "upper_m": [9, 9, 9]}
    task["robot"]["tool_start_m"] = [3.0, 0.0, 0.5]
    path = tmp_path / "far.yaml"
    path.write_text(yaml.safe_dump(task), encoding="utf-8")
    flags = ("--router", router, "--task", str(path))
    refuses("hmcs_robot", *flags, saying="reach")


def test_a_dead_zone_larger_than_the_motion(router: str, tmp_path: Path) -> None:
    path = tmp_path / "small.csv"
    path.write_text("time_s,x_m,y_m\n0,0,0\n1,0.01,0\n2,0.02,0\n", encoding="utf-8")
    flags = ("--source", "recorded", "--demonstration", str(path), "--dead-zone-m", "0.05")
    refuses("hmcs_input_device", "--router", router, *flags, saying="dead zone of 0.05 m")


@pytest.mark.parametrize(
    ("content", "saying"),
    [
        ("", "empty, expected the header"),
        ("time_s,x_m,y_m\n0,0,0\n", "one sample only"),
        ("time_s,x_m,y_m\n0,0,0\n1,nan,0\n", "small.csv:3"),
        ("time_s,x_m,y_m\n0,0,0\n1,1\n", "small.csv:3"),
        ("t,x,y\n0,0,0\n1,1,1\n", "time_s,x_m,y_m"),
    ],
    ids=["empty", "one sample", "NaN", "wrong dimension", "other columns"],
)
def test_a_demonstration_that_is_none(
    router: str, tmp_path: Path, content: str, saying: str
) -> None:
    path = tmp_path / "small.csv"
    path.write_text(content, encoding="utf-8")
    flags = ("--source", "recorded", "--demonstration", str(path))
    refuses("hmcs_input_device", "--router", router, *flags, saying=saying)


@pytest.mark.parametrize(
    ("service", "what", "name"),
    [
        *((service, "cell", "a*") for service in SERVICES),
        ("robot", "cell", "$x"),
        ("robot", "instance", "a/b"),
    ],
)
def test_a_name_that_cannot_be_part_of_a_key(
    model_file: Path, service: str, what: str, name: str
) -> None:
    flags = (*flags_of(service, model_file), f"--{what}", name)
    refuses(f"hmcs_{service}", *flags, saying=f"{name!r} cannot be part of a key")


@pytest.mark.parametrize("service", SERVICES)
def test_no_router_within_the_time_set(model_file: Path, service: str) -> None:
    nobody = with_free_port("tcp/127.0.0.1:0")
    flags = (*flags_of(service, model_file), "--router", nobody, "--connect-timeout-s", "0.3")
    refuses(f"hmcs_{service}", *flags, saying="start one with `hmcs router`")


def test_two_routers_on_one_port(router: str) -> None:
    refuses("hmcs.bus.router", "--listen", router, saying="taken")
