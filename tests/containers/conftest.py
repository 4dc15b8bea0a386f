"""The stack in containers: built and brought up once, looked at through its router."""

from __future__ import annotations

import json
import os
import secrets
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from hmcs.bus.config import BusSettings
from hmcs.bus.messages import Belief, FixtureState, RobotState
from hmcs.bus.session import Bus, Received
from hmcs_secure.closed_cell import ClosedCell

ROOT = Path(__file__).parents[2]
BUILD_TIMEOUT_S = 900
COMMAND_TIMEOUT_S = 120
LABEL = "com.docker.compose"
CELL = "container-test"


class Assisted(NamedTuple):
    """What was heard first of a robot that moves and is guided."""

    belief: Belief
    guiding: FixtureState
    moving: RobotState


class Containers:
    """One compose project of the stack, reached at a port of its own.

    `closed` is the folder of a cell that the stack is to be closed in, `variables` are more of
    compose.yaml's.
    """

    def __init__(
        self,
        compose: list[str],
        port: int,
        closed: Path | None = None,
        variables: Mapping[str, str] | None = None,
    ) -> None:
        self.project = f"hmcs-test-{secrets.token_hex(3)}"
        self.cell = CELL
        self.port = port
        files = ["compose.yaml"] if closed is None else ["compose.yaml", "compose.secure.yaml"]
        chosen = [word for file in files for word in ("--file", file)]
        self._compose = [*compose, *chosen, "--project-name", self.project]
        self._environment = {
            **os.environ,
            **({} if closed is None else {"HMCS_SECURE": str(closed)}),
            "HMCS_ROUTER_PORT": str(port),
            "HMCS_CONSOLE_PORT": str(free_port()),
            "HMCS_CELL": self.cell,
            # On a machine that also builds and starts containers, late is not yet missing.
            "HMCS_DEADLINE_MS": "500",
            **(variables or {}),
        }

    def compose(self, *words: str, timeout_s: float = COMMAND_TIMEOUT_S) -> str:
        return run([*self._compose, *words], timeout_s, self._environment)

    def docker(self, *words: str) -> str:
        return run(["docker", *words], COMMAND_TIMEOUT_S, self._environment)

    def ids(self, service: str | None = None) -> list[str]:
        """Every container of the project, or of one service; also those that have ended."""
        filters = [f"label={LABEL}.project={self.project}"]
        filters += [f"label={LABEL}.service={service}"] if service else []
        words = [word for each in filters for word in ("--filter", each)]
        return self.docker("ps", "--all", "--quiet", *words).split()

    def states(self) -> dict[str, dict[str, Any]]:
        """Docker's `State` of every container, by name."""
        found = json.loads(self.docker("inspect", *self.ids()))
        return {container["Name"].lstrip("/"): container["State"] for container in found}

    def logs(self) -> str:
        return self.compose("logs", "--no-color", "--tail=20")


def run(command: list[str], timeout_s: float, environment: dict[str, str]) -> str:
    done = subprocess.run(
        command,
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )
    if done.returncode:
        said = (done.stdout + done.stderr)[-4000:]
        pytest.fail(f"{' '.join(command)}: exit code {done.returncode}:\n{said}", pytrace=False)
    return done.stdout


def why_no_docker() -> str:
    """Say in one line why Docker cannot be used here; nothing where it can."""
    if shutil.which("docker") is None:
        return "there is no docker command"
    try:
        info = subprocess.run(["docker", "info"], capture_output=True, timeout=30, check=False)
    except subprocess.TimeoutExpired:
        return "the Docker engine does not answer"
    if info.returncode:
        return "no Docker engine answers"
    return "" if compose_command() else "there is neither docker compose nor docker-compose"


def compose_command() -> list[str]:
    plugin = ["docker", "compose"]
    if subprocess.run([*plugin, "version"], capture_output=True, check=False).returncode == 0:
        return plugin
    return ["docker-compose"] if shutil.which("docker-compose") else []


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


@pytest.fixture(scope="session")
def built() -> list[str]:
    """Build the images, once; return the words of compose that work here."""
    if reason := why_no_docker():
        pytest.skip(f"Docker cannot run here: {reason}")
    compose = compose_command()
    Containers(compose, free_port()).compose("build", timeout_s=BUILD_TIMEOUT_S)
    return compose


@pytest.fixture(scope="module")
def closed_cell() -> ClosedCell | None:
    """The cell that the stack is closed in; a module of tests may give one."""
    return None


@pytest.fixture(scope="module")
def variables() -> Mapping[str, str]:
    """More variables of compose.yaml; a module of tests may give some."""
    return {}


@pytest.fixture(scope="module")
def containers(
    built: list[str], closed_cell: ClosedCell | None, variables: Mapping[str, str]
) -> Iterator[Containers]:
    """The stack, up; taken down with its volumes afterwards, whatever happened."""
    closed = closed_cell and closed_cell.authority.folder
    stack = Containers(built, free_port(), closed, variables)
    try:
        stack.compose("up", "--detach", "--no-build")
        yield stack
    finally:
        stack.compose("down", "--volumes", "--timeout", "3")


@pytest.fixture
def bus(containers: Containers, closed_cell: ClosedCell | None) -> Iterator[Bus]:
    """A place on the bus of the containers, outside of them."""
    tls = {} if closed_cell is None else closed_cell.credentials("operator")._asdict()
    settings = BusSettings(
        router=f"{'tls' if tls else 'tcp'}/127.0.0.1:{containers.port}",
        cell=containers.cell,
        connect_timeout_s=30,
        **tls,
    )
    with Bus.open(settings, "operator", "container-test") as bus:
        yield bus


@pytest.fixture
def pump_until(bus: Bus, containers: Containers) -> Callable[..., None]:
    """Handle what comes from the bus until a condition holds; fails after a while."""

    def pump(condition: Callable[[], Any], within_s: float = 180.0) -> None:
        deadline_s = time.monotonic() + within_s
        while not condition():
            assert time.monotonic() < deadline_s, f"not in time; logs:\n{containers.logs()}"
            bus.pump(0.05)

    return pump


@pytest.fixture
def assisted(bus: Bus, pump_until: Callable[..., None]) -> Assisted:
    """Wait until the robot moves, the fixture guides and a belief is heard; return the first."""
    beliefs: list[Received[Belief]] = []
    guiding: list[Received[FixtureState]] = []
    moving: list[Received[RobotState]] = []
    bus.subscribe(Belief, bus.keys.belief(), beliefs.append)
    bus.subscribe(
        FixtureState,
        bus.keys.fixture_state,
        lambda got: guiding.append(got) if got.body.reason == "guiding" else None,
    )
    bus.subscribe(
        RobotState,
        bus.keys.robot_state,
        lambda got: moving.append(got) if np.linalg.norm(got.body.tool_twist[:3]) > 0.02 else None,
    )
    pump_until(lambda: beliefs and guiding and moving)
    return Assisted(beliefs[0].body, guiding[0].body, moving[0].body)
