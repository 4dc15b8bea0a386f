from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hmcs.bus.router import RouterError
from hmcs.errors import UserError
from hmcs_local import processes
from hmcs_local.stack import LocalStack, OneShotFailedError, StackError

Describe = Callable[..., dict[str, Any]]
WriteCompose = Callable[..., Path]
Eventually = Callable[[Callable[[], Any]], Any]
IsGone = Callable[[int], bool]

FREE = "tcp/127.0.0.1:0"
STUBBORN = (
    "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN);"
    "print('up', flush=True); time.sleep(600)"
)
PRINT_ENVIRONMENT = (
    "import os, sys, time;"
    "print(*sys.argv[1:], *(f'{k}={v}' for k, v in os.environ.items()), sep='\\n', flush=True);"
    "time.sleep(600)"
)


def test_every_process_ends_with_the_stack(
    write_compose: WriteCompose, service: Describe, tmp_path: Path, is_gone: IsGone
) -> None:
    path = write_compose(a=service(), b=service(scale=2))
    with LocalStack(path, router=FREE, folder=tmp_path) as stack:
        pids = [process.pid for process in stack.processes.values()]
        assert list(stack.processes) == ["a-1", "b-1", "b-2"]
        assert not any(is_gone(pid) for pid in pids)
    assert all(is_gone(pid) for pid in pids)


def test_every_process_ends_when_the_block_fails(
    write_compose: WriteCompose, service: Describe, tmp_path: Path, is_gone: IsGone
) -> None:
    path = write_compose(a=service())
    pids = []

    def fail() -> None:
        with LocalStack(path, router=FREE, folder=tmp_path) as stack:
            pids.append(stack.instance("a").pid)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert is_gone(pids[0])


def test_one_that_ignores_sigterm_is_killed_after_its_grace(
    write_compose: WriteCompose, service: Describe, tmp_path: Path, eventually: Eventually
) -> None:
    path = write_compose(a=service(STUBBORN, stop_grace_period="100ms"))
    with LocalStack(path, router=FREE, folder=tmp_path) as stack:
        process = stack.instance("a")
        eventually(process.last_lines)
    assert process.exit_code == -signal.SIGKILL


def test_a_hung_process_ends_with_the_stack(
    write_compose: WriteCompose, service: Describe, tmp_path: Path, eventually: Eventually
) -> None:
    path = write_compose(a=service())
    with LocalStack(path, router=FREE, folder=tmp_path) as stack:
        process = stack.instance("a")
        eventually(process.last_lines)
        stack.kill("a", signal_number=signal.SIGSTOP)
        assert process.running
    assert process.exit_code == -signal.SIGTERM


def test_one_that_even_sigkill_does_not_end_keeps_no_other_running(
    write_compose: WriteCompose,
    service: Describe,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(processes, "_KILL_WAIT_S", 0.1)
    path = write_compose(a=service(stop_grace_period="10ms"), b=service())
    stack = LocalStack(path, router=FREE, folder=tmp_path)
    stack.start_all()
    stuck, other = stack.processes["a-1"], stack.processes["b-1"]
    send = stuck.send
    monkeypatch.setattr(stuck, "send", lambda _: None)
    try:
        assert stack.stop_all() == {"a-1": -signal.SIGKILL, "b-1": -signal.SIGTERM}
        assert not other.running
        assert stuck.running
    finally:
        send(signal.SIGKILL)
        stuck.wait(10)


def test_what_a_service_started_ends_with_it(
    write_compose: WriteCompose,
    service: Describe,
    tmp_path: Path,
    eventually: Eventually,
    is_gone: IsGone,
) -> None:
    parent = (
        "import subprocess, sys, time;"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)']);"
        "print(child.pid, flush=True); time.sleep(600)"
    )
    path = write_compose(a=service(parent))
    with LocalStack(path, router=FREE, folder=tmp_path) as stack:
        child = int(eventually(stack.instance("a").last_lines)[0])
        stack.kill("a")
        eventually(lambda: is_gone(child))


def test_processes_die_with_a_launcher_that_is_killed(
    write_compose: WriteCompose,
    service: Describe,
    tmp_path: Path,
    eventually: Eventually,
    is_gone: IsGone,
) -> None:
    path = write_compose(a=service(), b=service(STUBBORN))
    script = textwrap.dedent(
        f"""
        import time
        from pathlib import Path
        from hmcs_local.stack import LocalStack
        with LocalStack(Path({str(path)!r}), router={FREE!r}, folder=Path({str(tmp_path)!r})) as it:
            print(*(process.pid for process in it.processes.values()), flush=True)
            time.sleep(600)
        """
    )
    launcher = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    try:
        assert launcher.stdout is not None
        pids = [int(word) for word in launcher.stdout.readline().split()]
        assert len(pids) == 2
    finally:
        launcher.kill()
        launcher.communicate()
    eventually(lambda: all(is_gone(pid) for pid in pids))


def test_a_one_shot_is_over_before_others_start(
    write_compose: WriteCompose, service: Describe, tmp_path: Path
) -> None:
    write = "from pathlib import Path; Path('/data/out'.replace('/data', D)).touch()"
    shot = service(
        "import os; D = os.environ['D'];" + write, environment={"D": "/data"}, volumes=["v:/data"]
    )
    needs = {"shot": {"condition": "service_completed_successfully"}}
    waits: list[None] = []
    path = write_compose(after=service(depends_on=needs), shot=shot)
    with LocalStack(
        path, router=FREE, folder=tmp_path, while_waiting=lambda: waits.append(None)
    ) as stack:
        assert (stack.volume("v") / "out").exists()
        assert list(stack.processes) == ["after-1"]
    assert waits


def test_a_failing_one_shot_is_reported_with_its_last_words_and_nothing_is_left(
    write_compose: WriteCompose, service: Describe, tmp_path: Path, is_gone: IsGone
) -> None:
    needs = {"shot": {"condition": "service_completed_successfully"}, "a": {"condition": "x"}}
    path = write_compose(
        a=service(),
        shot=service("raise SystemExit('no data')", depends_on=["a"]),
        after=service(depends_on=needs),
    )
    stack = LocalStack(path, router=FREE, folder=tmp_path)
    with pytest.raises(OneShotFailedError, match=r"(?s)shot failed with exit code 1:.*no data"):
        stack.__enter__()
    assert is_gone(stack.processes["a-1"].pid)
    assert "after-1" not in stack.processes


def test_a_service_gets_the_environment_of_compose_made_local(
    write_compose: WriteCompose,
    service: Describe,
    tmp_path: Path,
    eventually: Eventually,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("HMCS_CELL", "not-this")
    environment = {
        "HMCS_ROUTER": "tcp/router:7447",
        "HMCS_MODELS": '["/models", "/models/a.b", "/models-of-mine", "/my/models"]',
    }
    environment["HMCS_TASK"] = "/tasks/mine.yaml"
    volumes = ["m:/models:ro", f"{tmp_path}/mine:/tasks:ro"]
    described = service(PRINT_ENVIRONMENT, environment=environment, volumes=volumes)
    described["command"].append("/models/x")
    with LocalStack(
        write_compose(a=described),
        router=FREE,
        folder=tmp_path,
        environment={"a": {"HMCS_SEED": "3"}},
    ) as stack:
        process = stack.instance("a")
        said = eventually(
            lambda: process.log_path.read_text().splitlines() if process.last_lines() else []
        )
        router = stack.router
    models = tmp_path / "m"
    assert said[0] == f"{models}/x"
    assert f"HMCS_ROUTER={router}" in said
    assert not router.endswith(":0")
    assert f'HMCS_MODELS=["{models}", "{models}/a.b", "/models-of-mine", "/my/models"]' in said
    assert f"HMCS_TASK={tmp_path}/mine/mine.yaml" in said
    assert {"HMCS_SEED=3", "HMCS_INSTANCE=a-1", "OMP_NUM_THREADS=1"} <= set(said)
    assert not any(line.startswith("HMCS_CELL=") for line in said)


def test_only_the_services_named_are_started(
    write_compose: WriteCompose, service: Describe, tmp_path: Path
) -> None:
    path = write_compose(a=service(depends_on=["b"]), b=service())
    with LocalStack(path, services=["a"], router="tcp/127.0.0.1:1", folder=tmp_path) as stack:
        assert list(stack.processes) == ["a-1"]
        assert stack.router == "tcp/127.0.0.1:1"


def test_scale_overrides_compose(
    write_compose: WriteCompose, service: Describe, tmp_path: Path
) -> None:
    path = write_compose(a=service(scale=2), b=service())
    with LocalStack(path, scale={"a": 3, "b": 0}, router=FREE, folder=tmp_path) as stack:
        assert [process.instance for process in stack.instances("a")] == ["a-1", "a-2", "a-3"]
        assert stack.instances("b") == []


@pytest.mark.parametrize("scale", [{"router": 2}, {"nobody": 2}, {"a": -1}])
def test_a_scale_that_makes_no_sense_is_refused(
    write_compose: WriteCompose, service: Describe, tmp_path: Path, scale: dict[str, int]
) -> None:
    with pytest.raises(UserError, match=next(iter(scale))):
        LocalStack(write_compose(a=service()), scale=scale, folder=tmp_path)


def test_a_killed_instance_is_replaced_under_a_new_name_or_started_again_under_its_own(
    write_compose: WriteCompose, service: Describe, tmp_path: Path
) -> None:
    path = write_compose(a=service(scale=2))
    with LocalStack(path, router=FREE, folder=tmp_path) as stack:
        killed = stack.kill("a", 0)
        assert killed.exit_code == -signal.SIGKILL
        assert stack.start("a").instance == "a-3"
        assert [process.instance for process in stack.instances("a")] == ["a-2", "a-3"]
        assert stack.restart("a-1").running
        with pytest.raises(StackError, match="a-2 runs already"):
            stack.restart("a-2")
        with pytest.raises(StackError, match="none has index 3"):
            stack.kill("a", 3)


def test_a_program_that_is_not_there_is_reported(
    write_compose: WriteCompose, service: Describe, tmp_path: Path
) -> None:
    path = write_compose(a=service())
    with (
        LocalStack(path, router=FREE, folder=tmp_path) as stack,
        pytest.raises(StackError, match="no program 'no-such-program'"),
    ):
        stack.start("a", command=["no-such-program"])


def test_a_taken_router_port_is_reported(
    write_compose: WriteCompose, service: Describe, tmp_path: Path
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        stack = LocalStack(write_compose(a=service()), router=endpoint, folder=tmp_path)
        with pytest.raises(RouterError, match="taken"):
            stack.__enter__()
    assert stack.processes == {}


def test_a_process_leads_a_group_of_its_own_as_a_child_of_the_launcher(
    write_compose: WriteCompose, service: Describe, tmp_path: Path, eventually: Eventually
) -> None:
    path = write_compose(a=service("import os; print(os.getpgid(0), os.getppid(), flush=True)"))
    with LocalStack(path, router=FREE, folder=tmp_path) as stack:
        process = next(iter(stack.processes.values()))
        group, parent = eventually(process.last_lines)[0].split()
    assert int(group) == process.pid != os.getpgid(0)
    assert int(parent) == os.getpid()
