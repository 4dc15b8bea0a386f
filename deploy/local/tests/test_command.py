from __future__ import annotations

import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

Describe = Callable[..., dict[str, Any]]
Eventually = Callable[[Callable[[], Any]], Any]
IsGone = Callable[[int], bool]
Run = Callable[..., subprocess.CompletedProcess[str]]

HMCS = [sys.executable, "-m", "hmcs_local.command"]
IGNORES_SIGINT = (
    "import signal, time; signal.signal(signal.SIGINT, signal.SIG_IGN);"
    "print('up', flush=True); time.sleep(600)"
)


@pytest.fixture
def up(
    environment: dict[str, str], tmp_path: Path, eventually: Eventually
) -> Iterator[Callable[..., tuple[subprocess.Popen[str], list[int]]]]:
    """Run `hmcs up` until it says that it runs; returns it and its processes."""
    started = []

    def start(*words: str) -> tuple[subprocess.Popen[str], list[int]]:
        out = tmp_path / "up.out"
        with out.open("w") as file:
            launcher = subprocess.Popen(
                [*HMCS, "up", *words], cwd=tmp_path, env=environment, stdout=file, stderr=file
            )
        started.append(launcher)
        eventually(lambda: "processes run" in out.read_text() or launcher.poll() is not None)
        assert launcher.poll() is None, out.read_text()
        children = psutil.Process(launcher.pid).children(recursive=True)
        return launcher, [child.pid for child in children]

    yield start
    for launcher in started:
        launcher.kill()
        launcher.wait()


def mistake(done: subprocess.CompletedProcess[str]) -> str:
    """The message of a user's mistake: alone on stderr, in one line, with exit code 2."""
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1
    return done.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_up_ends_with_0_and_leaves_nothing_behind(
    up: Callable[..., Any],
    write_compose: Callable[..., Path],
    service: Describe,
    is_gone: IsGone,
    number: signal.Signals,
) -> None:
    write_compose(a=service(scale=2), b=service(IGNORES_SIGINT))
    launcher, pids = up("--router", "tcp/127.0.0.1:0")
    assert len(pids) == 3
    launcher.send_signal(number)
    assert launcher.wait(10) == 0
    assert all(is_gone(pid) for pid in pids)


@pytest.mark.parametrize(("words", "count"), [((), 2), (("--services", "router,b"), 1)])
def test_up_starts_a_service_behind_a_profile_only_where_it_is_named(
    up: Callable[..., Any],
    write_compose: Callable[..., Path],
    service: Describe,
    words: tuple[str, ...],
    count: int,
) -> None:
    write_compose(a=service(scale=2), b=service(profiles=["ros2"]))
    assert len(up("--router", "tcp/127.0.0.1:0", *words)[1]) == count


def test_up_leaves_nothing_behind_when_it_is_killed(
    up: Callable[..., Any],
    write_compose: Callable[..., Path],
    service: Describe,
    eventually: Eventually,
    is_gone: IsGone,
) -> None:
    write_compose(a=service(scale=2))
    launcher, pids = up("--router", "tcp/127.0.0.1:0")
    launcher.kill()
    eventually(lambda: all(is_gone(pid) for pid in pids))


def test_up_interrupted_during_a_one_shot_leaves_nothing_behind(
    environment: dict[str, str],
    write_compose: Callable[..., Path],
    service: Describe,
    tmp_path: Path,
    eventually: Eventually,
    is_gone: IsGone,
) -> None:
    needs = {"shot": {"condition": "service_completed_successfully"}}
    write_compose(shot=service(), after=service(depends_on=needs))
    launcher = subprocess.Popen(
        [*HMCS, "up", "--router", "tcp/127.0.0.1:0"],
        cwd=tmp_path,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        log = tmp_path / "out/up/logs/shot.log"
        eventually(lambda: log.exists() and log.read_text())
        (shot,) = psutil.Process(launcher.pid).children()
        launcher.send_signal(signal.SIGINT)
        assert launcher.wait(10) == 0
    finally:
        launcher.kill()
        launcher.wait()
    assert is_gone(shot.pid)


def test_up_ends_when_everything_has_ended(
    hmcs: Run, write_compose: Callable[..., Path], service: Describe
) -> None:
    write_compose(a=service("raise SystemExit(0)"), b=service("raise SystemExit(5)"))
    done = hmcs("up", "--router", "tcp/127.0.0.1:0")
    assert done.returncode == 1
    assert "b-1 ended (exit code 5), not started again" in done.stdout
    assert "nothing runs any more" in done.stdout


def test_a_second_up_in_one_folder_is_refused(
    up: Callable[..., Any], hmcs: Run, write_compose: Callable[..., Path], service: Describe
) -> None:
    write_compose(a=service())
    up("--router", "tcp/127.0.0.1:0")
    assert "another `hmcs up` works in" in mistake(hmcs("up", "--router", "tcp/127.0.0.1:0"))


def test_up_in_a_folder_that_is_none_is_refused(
    hmcs: Run, write_compose: Callable[..., Path], service: Describe, tmp_path: Path
) -> None:
    write_compose(a=service())
    (tmp_path / "file").touch()
    done = hmcs("up", "--router", "tcp/127.0.0.1:0", "--folder", "file/up")
    assert "--folder: file: is no folder" in mistake(done)


def test_up_on_a_taken_port_is_refused(
    hmcs: Run, write_compose: Callable[..., Path], service: Describe
) -> None:
    write_compose(a=service())
    with socket.create_server(("127.0.0.1", 0)) as taken:
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        assert "taken" in mistake(hmcs("up", "--router", endpoint))


@pytest.mark.long
@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["up", "--services", "nobody"], "unknown service 'nobody'"),
        (["up", "--scale", "a"], "--scale a: write SERVICE=N"),
        (["up", "--scale", "a=-1"], "--scale a=-1: write SERVICE=N"),
        (["up", "--scale", "router=2"], "--scale router=2"),
        (["up", "--router", "nonsense"], "nonsense"),
        (["up", "--compose", "none.yaml"], "none.yaml: cannot be read"),
        (["status", "--once", "--router", "nonsense"], "nonsense"),
        (["status", "--once", "--cell", "a/b"], "'a/b'"),
        (["status", "--once", "--router", "tcp/127.0.0.1:1"], "no router at tcp/127.0.0.1:1"),
        (["swap"], "name either a classifier to replace or a model"),
        (["swap", "a", "--activate", "b"], "name either a classifier to replace or a model"),
        (["swap", "--with", "x", "--activate", "b"], "name either a classifier"),
    ],
)
def test_a_mistake_is_one_message_and_exit_code_2(
    hmcs: Run,
    write_compose: Callable[..., Path],
    service: Describe,
    words: list[str],
    complaint: str,
) -> None:
    write_compose(a=service())
    assert complaint in mistake(hmcs(*words))


def test_nothing_is_opened_to_the_network_unless_it_is_asked_for(
    up: Callable[..., Any],
    hmcs: Run,
    write_compose: Callable[..., Path],
    service: Describe,
) -> None:
    write_compose(a=service())
    for words in (["up", "--router"], ["router", "--listen"]):
        said = mistake(hmcs(*words, "tcp/0.0.0.0:0"))
        assert "everybody who reaches it can move the robot" in said
        assert "--open-to-network" in said
        assert "can move the robot" in " ".join(hmcs(words[0], "--help").stdout.split())
    launcher, _ = up("--router", "tcp/0.0.0.0:0", "--open-to-network")
    listening = psutil.Process(launcher.pid).net_connections("tcp")
    assert "0.0.0.0" in {each.laddr.ip for each in listening if each.status == "LISTEN"}


def test_what_a_terminal_cannot_show_is_shown_otherwise(
    environment: dict[str, str], tmp_path: Path
) -> None:
    done = subprocess.run(
        [*HMCS, "task", "check", "nö-tåsk.yaml"],
        cwd=tmp_path,
        env={**environment, "PYTHONIOENCODING": "ascii:strict"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert r"n\xf6-t\xe5sk.yaml" in mistake(done)


def test_an_unknown_option_ends_with_2(hmcs: Run) -> None:
    done = hmcs("up", "--no-such-option")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_a_program_of_its_own_ends_with_2_as_well(
    environment: dict[str, str], tmp_path: Path
) -> None:
    done = subprocess.run(
        [*HMCS, "up", "--compose", "none.yaml"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert "none.yaml" in mistake(done)


def test_a_task_file_is_checked(hmcs: Run, tmp_path: Path) -> None:
    assert hmcs("task", "check", "human-shapes").returncode == 0
    (tmp_path / "bad.yaml").write_text("format: hmcs-task/1\nname: bad\ndead_zone_m: -1\n")
    done = hmcs("task", "check", "bad.yaml")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert "bad.yaml" in done.stderr
    assert "dead_zone_m" in done.stderr
    assert "gestemes" in done.stderr


@pytest.mark.long
def test_a_model_is_trained_from_demonstrations(hmcs: Run, tmp_path: Path) -> None:
    shapes = ("GShape", "NShape", "PShape", "JShape", "Snake")
    drawings = [f"lasa:{shape}/1-3" for shape in shapes]
    done = hmcs("train", "human-shapes", *drawings, "--output", "m.hmcs", "--name", "mine")
    assert done.returncode == 0, done.stderr
    assert "m.hmcs: model mine" in done.stdout
    assert (tmp_path / "m.hmcs").stat().st_size > 0
    assert "Nonesuch" in mistake(
        hmcs("train", "human-shapes", "lasa:Nonesuch/1", "--output", "m.hmcs")
    )
