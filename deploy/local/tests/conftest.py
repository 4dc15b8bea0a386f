"""Small stacks of fake services, described as the real one is, and commands run in them."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
import yaml

from hmcs.bus.config import BusSettings
from hmcs.bus.messages import (
    ActivateRecognizer,
    Ask,
    Description,
    Done,
    Health,
    LoadModel,
)
from hmcs.bus.session import Bus, RequestRefusedError
from hmcs.recognition.model_file import save_model
from hmcs.task import Task
from hmcs_local import deploying
from hmcs_local.command import main
from hmcs_local.connecting import open_operator
from hmcs_local.control import ControlServer
from hmcs_local.deploying import Agreement
from hmcs_local.stack import LocalStack
from support.deployed import CELL, TASK, UP_WITHIN_S, Cell, Describe, Served
from support.made_up import line_model

Run = Callable[..., subprocess.CompletedProcess[str]]

FAKE_CLASSIFIER = textwrap.dedent(
    """
    import os, signal, threading
    from hmcs.bus.config import BusSettings
    from hmcs.bus.session import Bus

    stop = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    instance = os.environ["HMCS_INSTANCE"]
    settings = BusSettings(router=os.environ["HMCS_ROUTER"], cell=os.environ["HMCS_CELL"])
    with Bus.open(settings, "gesteme_classifier", instance) as bus:
        bus.announce(bus.keys.presence("gesteme_classifier", instance))
        bus.announce(bus.keys.member("fake", "gesteme_classifier", instance))
        print("ready", flush=True)
        stop.wait()
    """
)
SLEEPER = "import time; print('sleeping', flush=True); time.sleep(600)"


def python(script: str) -> list[str]:
    return ["python", "-c", script]


@pytest.fixture
def write_compose(tmp_path: Path) -> Callable[..., Path]:
    """Write a compose file with a router and the given services; returns its path."""

    def write(**services: dict[str, Any]) -> Path:
        path = tmp_path / "compose.yaml"
        named = {name.replace("_", "-"): service for name, service in services.items()}
        document = {"services": {"router": {"image": "any"}, **named}}
        path.write_text(yaml.safe_dump(document), encoding="utf-8")
        return path

    return write


@pytest.fixture
def service() -> Callable[..., dict[str, Any]]:
    """Describe a service as compose.yaml does; it sleeps unless a script is given."""

    def describe(script: str = SLEEPER, **more: Any) -> dict[str, Any]:
        return {"command": python(script), "stop_grace_period": "2s", **more}

    return describe


@pytest.fixture
def classifier(service: Callable[..., dict[str, Any]]) -> dict[str, Any]:
    """A fake gesteme classifier: on the bus, ready at once, publishing nothing."""
    environment = {"HMCS_ROUTER": "tcp/router:7447", "HMCS_CELL": "fake"}
    return service(FAKE_CLASSIFIER, environment=environment)


class Fixture:
    """A fixture controller that carries out requests, or refuses; `asked` holds them."""

    def __init__(self, active: str = "") -> None:
        self.active = active
        self.refuses = False
        self.answers_after_s = 0.0
        self.asked: list[str] = []

    def load(self, question: LoadModel) -> Done:
        self.asked.append(f"load {question.path}")
        return Done(detail="loaded")

    def activate(self, question: ActivateRecognizer) -> Done:
        self.asked.append(f"activate {question.model}")
        if self.refuses:
            raise RequestRefusedError("not now")
        self.active = question.model
        time.sleep(self.answers_after_s)
        return Done(detail=f"follows {question.model}")

    def describe(self, _: Ask) -> Description:
        return Description(
            version="1",
            publishes=(),
            subscribes=(),
            answers=(),
            facts={"active_model": self.active},
        )

    @contextmanager
    def live(self, router: str, cell: str, instance: str = "f") -> Iterator[None]:
        """Be there, as a process of its own would."""
        over = threading.Event()
        settings = BusSettings(router=router, cell=cell)
        with Bus.open(settings, "fixture_controller", instance) as bus:
            bus.answer("load_model", LoadModel, self.load)
            bus.answer("activate", ActivateRecognizer, self.activate)
            bus.answer("describe", Ask, self.describe)
            bus.answer("health", Ask, lambda _: WELL)
            bus.announce(bus.keys.presence("fixture_controller", instance))

            def pump() -> None:
                while not over.is_set():
                    bus.pump(0.01)

            thread = threading.Thread(target=pump)
            thread.start()
            try:
                yield
            finally:
                over.set()
                thread.join()


WELL = Health(
    healthy=True,
    detail="running",
    uptime_s=10.0,
    loop_rate_hz=100.0,
    cpu_s=1.0,
    received={},
    sent={},
    lost={},
    refused={},
    late={},
)


@pytest.fixture
def fixture_controller(
    eventually: Callable[[Callable[[], Any]], Any],
) -> Iterator[Callable[..., Fixture]]:
    """Bring up fixture controllers that are seen by a bus, until the test ends."""
    with ExitStack() as up:

        def bring_up(bus: Bus, active: str = "", instance: str = "f") -> Fixture:
            fixture = Fixture(active)
            up.enter_context(fixture.live(bus.settings.router, bus.settings.cell, instance))
            presence = bus.keys.presence("fixture_controller", instance)
            eventually(lambda: bus.alive(presence))
            return fixture

        yield bring_up


@pytest.fixture
def eventually() -> Callable[[Callable[[], Any]], Any]:
    """Wait until a condition holds; fails after 10 s. Returns what the condition returned."""

    def wait(condition: Callable[[], Any], within_s: float = 10.0) -> Any:
        deadline_s = time.monotonic() + within_s
        while not (value := condition()):
            assert time.monotonic() < deadline_s, "did not come about in time"
            time.sleep(0.01)
        return value

    return wait


@pytest.fixture
def served() -> Callable[[LocalStack, Callable[[], Any]], Any]:
    """Do what another command would do, while the stack's launcher answers it here."""

    def serve(stack: LocalStack, command: Callable[[], Any]) -> Any:
        with ControlServer(stack) as server, ThreadPoolExecutor(1) as other:
            result = other.submit(command)
            while not result.done():
                server.serve(0.02)
        return result.result()

    return serve


@pytest.fixture
def is_gone() -> Callable[[int], bool]:
    """Tell whether a process is no more, or only waits to be reaped."""

    def gone(pid: int) -> bool:
        try:
            return bool(psutil.Process(pid).status() == psutil.STATUS_ZOMBIE)
        except psutil.NoSuchProcess:
            return True

    return gone


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    kept = {key: value for key, value in os.environ.items() if not key.startswith("HMCS_")}
    return {**kept, "XDG_RUNTIME_DIR": str(tmp_path), "COLUMNS": "160"}


@pytest.fixture
def hmcs(
    environment: dict[str, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> Run:
    """Run `hmcs` to its end, in this process: starting Python takes longer than most commands."""

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(os, "environ", environment)
        monkeypatch.setattr(sys, "argv", ["hmcs", *words])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capfd.readouterr()
        return subprocess.CompletedProcess(words, int(ended.value.code or 0), said.out, said.err)

    return run


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    """Model files: `mine`, `yours`, and another model of the name `mine`."""
    task = Task.model_validate(TASK)
    made = {}
    for file, name, length_m in (
        ("mine", "mine", 0.5),
        ("yours", "yours", 0.5),
        ("2", "mine", 0.4),
    ):
        made[file] = tmp_path / f"{file}.hmcs"
        points = np.array([[0.0, 0, 0], [length_m, 0, 0]])
        save_model(line_model(name, task, points), made[file])
    return made


@pytest.fixture
def stack(
    write_compose: Callable[..., Path],
    service: Describe,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Iterator[LocalStack]:
    """A stack whose only process is no recognizer; recognizers can be started in it."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    place = {"HMCS_ROUTER": "tcp/router:7447", "HMCS_CELL": CELL}
    path = write_compose(a=service(), recognizer=service(environment=place, scale=0))
    with LocalStack(path, router="tcp/127.0.0.1:0", folder=tmp_path / "up") as stack:
        yield stack


@pytest.fixture
def bus(stack: LocalStack) -> Iterator[Bus]:
    with open_operator(stack.router, CELL) as bus:
        # It shows the tokens of others as well.
        bus.rights = None
        yield bus


@pytest.fixture
def cell(stack: LocalStack, bus: Bus, served: Served, monkeypatch: pytest.MonkeyPatch) -> Cell:
    monkeypatch.setattr(deploying, "watched", lambda *_: Agreement(0, 0))
    monkeypatch.setattr(deploying, "READY_WITHIN_S", UP_WITHIN_S)
    return Cell(stack, bus, served)
