"""Routers and buses of a test's own, all closed when it ends."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from hmcs.bus.router import open_router
from hmcs.bus.session import Bus, BusSettings

DEADLINE_S = 60.0


@pytest.fixture
def until() -> Callable[[Callable[[], Any]], Any]:
    """Wait for a condition, with a deadline, and return what it gave."""

    def wait(condition: Callable[[], Any]) -> Any:
        deadline_s = time.monotonic() + DEADLINE_S
        while not (value := condition()):
            assert time.monotonic() < deadline_s, "the condition did not come true in time"
            time.sleep(0.005)
        return value

    return wait


@pytest.fixture
def free_endpoint() -> str:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return f"tcp/127.0.0.1:{server.getsockname()[1]}"


@pytest.fixture
def router(free_endpoint: str) -> Iterator[str]:
    """The endpoint of a router."""
    with open_router(free_endpoint):
        yield free_endpoint


@pytest.fixture
def restartable_router(free_endpoint: str, spawn, until) -> Restartable:
    return Restartable(free_endpoint, spawn, until)


class Restartable:
    """A router of its own process, that can be stopped and started on one endpoint."""

    SOURCE = "import sys; from hmcs.bus.router import main; sys.exit(main(sys.argv[1:]))"

    def __init__(self, endpoint: str, spawn, until) -> None:
        self.endpoint = endpoint
        self._spawn = spawn
        self._until = until
        self._process: subprocess.Popen[str] | None = None

    def start(self) -> None:
        self._process = self._spawn(self.SOURCE, "--listen", self.endpoint)
        self._until(lambda: "ready" in self._process.log.read_text())

    def stop(self) -> None:
        self._process.terminate()
        assert self._process.wait(DEADLINE_S) == 0


@pytest.fixture
def join(router: str) -> Iterator[Callable[..., Bus]]:
    """Open buses: `join("service", "instance")`."""
    with contextlib.ExitStack() as opened:

        def open_bus(service: str = "tester", instance: str = "a", **settings: object) -> Bus:
            return opened.enter_context(
                Bus.open(
                    BusSettings(router=router, cell="test", **settings),
                    service,
                    instance,
                    log=logging.getLogger("hmcs.test"),
                )
            )

        yield open_bus


@pytest.fixture
def spawn(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start a Python process: `spawn(source, *arguments)`; its output goes to `.log`."""
    started: list[subprocess.Popen[str]] = []

    def start(source: str, *arguments: str, **environment: str) -> subprocess.Popen[str]:
        number = len(started)
        script = tmp_path / f"script_{number}.py"
        script.write_text(source, encoding="utf-8")
        log = tmp_path / f"log_{number}.txt"
        with log.open("w", encoding="utf-8") as out:
            process = subprocess.Popen(
                [sys.executable, str(script), *arguments],
                stdout=out,
                stderr=subprocess.STDOUT,
                env={**os.environ, **environment},
                text=True,
            )
        process.log = log  # type: ignore[attr-defined]
        started.append(process)
        return process

    yield start
    for process in started:
        if process.poll() is None:
            process.send_signal(signal.SIGCONT)
            process.kill()
        process.wait()
