"""A new model takes over while the hand moves, and the one before comes back."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from hmcs.bus.messages import Belief, Command, FixtureState
from hmcs.bus.session import Bus, Received
from hmcs_local.control import Control, ControlServer
from hmcs_local.deploying import Agreement, DeployError, active_model, back, deploy, read_history
from hmcs_local.observer import open_observer
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
        self.commands: list[Received[Command]] = []

    def watched(self, act: Callable[[Bus], Any]) -> Any:
        """Do what another command would do, while everything that is said is kept."""
        with (
            ControlServer(self.stack) as server,
            open_observer(self.stack.router, CELL) as watcher,
            ThreadPoolExecutor(1) as other,
        ):
            keys = watcher.keys
            watcher.subscribe(Belief, keys.belief(), self.beliefs.append)
            watcher.subscribe(FixtureState, keys.fixture_state, self.fixtures.append)
            watcher.subscribe(Command, keys.command, self.commands.append)

            def apart() -> Any:
                with open_observer(self.stack.router, CELL) as bus:
                    return act(bus)

            result = other.submit(apart)
            while not result.done():
                server.serve(0.001)
                watcher.pump(0.005)
            for _ in range(50):
                watcher.pump(0.01)
        return result.result()


@pytest.fixture
def running(
    tmp_path: Path, performance_file: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Running]:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    place = {"HMCS_ROUTER": "tcp/router:7447", "HMCS_CELL": CELL}

    def service(module: str, **environment: str) -> dict[str, Any]:
        return {"command": ["python", "-m", module], "environment": {**place, **environment}}

    compose = tmp_path / "compose.yaml"
    services = {
        "router": {"image": "any"},
        "recognizer": service("hmcs_recognizer", HMCS_MODEL=""),
        "fixture-controller": service("hmcs_fixture_controller"),
        "input-device": service(
            "hmcs_input_device",
            HMCS_TASK="human-shapes",
            HMCS_SOURCE="recorded",
            HMCS_DEMONSTRATION=str(performance_file),
            HMCS_REPEAT="0",
            HMCS_WAIT_FOR=json.dumps(["fixture_controller"]),
        ),
    }
    compose.write_text(yaml.safe_dump({"services": services}))
    with LocalStack(compose, router="tcp/127.0.0.1:0", folder=tmp_path / "up") as stack:
        until_present(stack.router, {"recognizer", "fixture_controller", "input_device"})
        yield Running(stack)


def until_present(router: str, services: set[str]) -> None:
    """Wait until everybody is there."""
    deadline_s = time.monotonic() + DEADLINE_S
    with open_observer(router, CELL) as bus:
        while not services <= {
            bus.keys.member_of(k).service for k in bus.alive(bus.keys.presence())
        }:
            assert time.monotonic() < deadline_s
            bus.pump(0.05)


def test_models_take_over_one_after_another_without_a_gap_and_come_back(
    running: Running, model_file: Path, shadow_model_file: Path
) -> None:
    folder = running.stack.folder

    def first(bus: Bus) -> str:
        deploy(bus, running.control, folder, model_file, watch_s=1.0)
        return active_model(bus)

    assert running.watched(first) == "human-shapes"
    with pytest.raises(DeployError, match="nothing to return to"):
        running.watched(lambda bus: back(bus, running.control, folder))

    def second(bus: Bus) -> Agreement:
        agreement = deploy(bus, running.control, folder, shadow_model_file, watch_s=4.0)
        assert active_model(bus) == "shadow"
        return agreement

    running.commands.clear()
    running.fixtures.clear()
    running.beliefs.clear()
    steps, alike = running.watched(second)
    assert steps > 10
    assert alike > 0.8 * steps
    # The old one has left, and no step went without a belief of the active one.
    assert [d.model for d in read_history(folder).deployed] == ["human-shapes", "shadow"]
    recognizers = [p for p in running.stack.instances("recognizer") if p.running]
    assert len(recognizers) == 2
    told = {received.body.step for received in running.beliefs}
    assert told == set(range(min(told), max(told) + 1))
    gaps = np.diff([received.received_ns for received in running.commands]) / 1e9
    assert np.percentile(gaps, 99) < 2 * TICK_S + 0.01
    factors = np.array([received.body.factor for received in running.fixtures])
    seconds = np.diff([received.received_ns for received in running.fixtures]) / 1e9
    assert (np.abs(np.diff(factors)) <= 16.0 * np.maximum(seconds, TICK_S) + 0.05).all()

    assert running.watched(lambda bus: back(bus, running.control, folder)) == "human-shapes"
    assert running.watched(active_model) == "human-shapes"
    assert [d.model for d in read_history(folder).deployed] == ["human-shapes"]


def test_a_model_of_the_name_of_the_active_one_is_refused(
    running: Running, model_file: Path, other_model_file: Path
) -> None:
    folder = running.stack.folder
    running.watched(lambda bus: deploy(bus, running.control, folder, model_file, watch_s=0.0))
    with pytest.raises(DeployError, match="train it under another name"):
        running.watched(
            lambda bus: deploy(bus, running.control, folder, other_model_file, watch_s=0.0)
        )
