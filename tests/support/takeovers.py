"""A stack in which models take over from one another while its hand moves."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from hmcs.bus.mailbox import Arrival
from hmcs.bus.messages import Belief, FixtureState
from hmcs.bus.session import Bus, Received
from hmcs_local.connecting import open_operator
from hmcs_local.control import Control, ControlServer
from hmcs_local.stack import LocalStack
from support.stack import DEADLINE_S

CELL = "demo"
TICK_S = 0.01
"""Of the input device."""


class Running:
    """A stack with a hand in motion, and what it says."""

    def __init__(self, stack: LocalStack) -> None:
        self.stack, self.control = stack, Control(stack.folder)
        self.beliefs: list[Received[Belief]] = []
        self.fixtures: list[Received[FixtureState]] = []
        self.commands: list[Arrival] = []
        """Each one, also those that came while this process did something else."""

    def watched(self, act: Callable[[Bus], Any]) -> Any:
        """Do what another command would do, while everything that is said is kept."""
        with (
            ControlServer(self.stack) as server,
            open_operator(self.stack.router, CELL) as watcher,
            ThreadPoolExecutor(1) as other,
        ):
            keys = watcher.keys
            watcher.subscribe(Belief, keys.belief(), self.beliefs.append)
            watcher.subscribe(FixtureState, keys.fixture_state, self.fixtures.append)
            watcher.listen(keys.command, self.commands.append)

            def apart() -> Any:
                with open_operator(self.stack.router, CELL) as bus:
                    return act(bus)

            result = other.submit(apart)
            while not result.done():
                server.serve(0.001)
                watcher.pump(0.005)
            for _ in range(50):
                watcher.pump(0.01)
        return result.result()


@contextmanager
def brought_up(folder: Path, performance_file: Path) -> Iterator[Running]:
    """Bring up recognizer, fixture and a hand that performs a demonstration for ever."""
    place = {"HMCS_ROUTER": "tcp/router:7447", "HMCS_CELL": CELL}

    def service(module: str, **environment: str) -> dict[str, Any]:
        return {"command": ["python", "-m", module], "environment": {**place, **environment}}

    compose = folder / "compose.yaml"
    services = {
        "router": {"image": "any"},
        "recognizer": service("hmcs_recognizer", HMCS_MODEL=""),
        "fixture-controller": service("hmcs_fixture_controller"),
        "input-device": service(
            "hmcs_input_device",
            HMCS_TASK="human-shapes",
            HMCS_SOURCE="recorded",
            HMCS_DEMONSTRATION=str(performance_file),
            HMCS_RATE_HZ=f"{1 / TICK_S:.0f}",
            HMCS_REPEAT="0",
            HMCS_WAIT_FOR=json.dumps(["fixture_controller"]),
        ),
    }
    compose.write_text(yaml.safe_dump({"services": services}))
    with LocalStack(compose, router="tcp/127.0.0.1:0", folder=folder / "up") as stack:
        _until_present(stack.router, {"recognizer", "fixture_controller", "input_device"})
        yield Running(stack)


def _until_present(router: str, services: set[str]) -> None:
    """Wait until everybody is there."""
    deadline_s = time.monotonic() + DEADLINE_S
    with open_operator(router, CELL) as bus:
        while not services <= {
            bus.keys.member_of(k).service for k in bus.alive(bus.keys.presence())
        }:
            assert time.monotonic() < deadline_s
            bus.pump(0.05)
