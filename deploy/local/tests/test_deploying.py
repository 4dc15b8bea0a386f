"""A newcomer takes over or goes again, whatever comes in between."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import zenoh

from hmcs.bus.keys import Keys
from hmcs.bus.messages import Description, Envelope, Source
from hmcs.bus.session import Bus, BusSettings
from hmcs.bus.wire import encode
from hmcs.recognition.model_file import load_model
from hmcs_local import deploying, swap
from hmcs_local.deploying import Agreement, DeployError, History, active_model, read_history
from hmcs_local.stack import LocalStack
from hmcs_local.swap import SwapError
from support.deployed import CELL, UP_WITHIN_S, Cell, Eventually, Served


@pytest.mark.long
def test_a_newcomer_takes_over_is_replaced_and_comes_back(
    cell: Cell, files: dict[str, Path], fixture_controller: Callable[..., Any]
) -> None:
    fixture = fixture_controller(cell.bus)
    cell.deploy(files["mine"])
    assert (fixture.active, cell.running, cell.deployed) == ("mine", ["recognizer-1"], ["mine"])
    cell.deploy(files["yours"])
    assert (fixture.active, cell.running) == ("yours", ["recognizer-2"])
    assert cell.deployed == ["mine", "yours"]
    cell.back()
    assert (fixture.active, cell.running, cell.deployed) == ("mine", ["recognizer-3"], ["mine"])
    assert read_history(cell.folder).shadow is None


def test_a_newcomer_the_fixture_refuses_goes_again_however_often(
    cell: Cell, files: dict[str, Path], fixture_controller: Callable[..., Any]
) -> None:
    fixture = fixture_controller(cell.bus, active="human-shapes")
    fixture.refuses = True
    for _ in range(2):
        with pytest.raises(SwapError, match="not now"):
            cell.deploy(files["mine"])
        assert cell.running == []
        assert cell.reported[-1].endswith("is stopped again")
        assert read_history(cell.folder) == History()


@pytest.mark.parametrize(
    ("when", "how"),
    [
        ("until_ready", KeyboardInterrupt),
        ("watched", KeyboardInterrupt),
        ("watched", MemoryError),
        ("activate", KeyboardInterrupt),
        ("activate", SwapError),
        ("write_history", DeployError),
    ],
)
def test_whatever_happens_before_it_takes_over_the_newcomer_goes_again(
    cell: Cell,
    files: dict[str, Path],
    fixture_controller: Callable[..., Any],
    monkeypatch: pytest.MonkeyPatch,
    when: str,
    how: type[BaseException],
) -> None:
    fixture_controller(cell.bus, active="human-shapes")

    def fail(*_: Any) -> Any:
        raise how("now")

    with monkeypatch.context() as patch:
        patch.setattr(swap if when in ("until_ready", "activate") else deploying, when, fail)
        with pytest.raises(how):
            cell.deploy(files["mine"])
    assert cell.running == []
    assert read_history(cell.folder).deployed == ()


def test_a_newcomer_that_is_followed_goes_on_whatever_fails_then(
    cell: Cell,
    files: dict[str, Path],
    fixture_controller: Callable[..., Any],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fixture = fixture_controller(cell.bus, active="human-shapes")
    activate = swap.activate

    def then_fail(bus: Bus, model: str) -> str:
        activate(bus, model)
        raise KeyboardInterrupt

    monkeypatch.setattr(swap, "activate", then_fail)
    with pytest.raises(KeyboardInterrupt):
        cell.deploy(files["mine"])
    monkeypatch.undo()
    assert (fixture.active, cell.running) == ("mine", ["recognizer-1"])
    # What the next one finds is that it has taken over.
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(cell.folder.parent))
    monkeypatch.setattr(deploying, "watched", lambda *_: Agreement(0, 0))
    cell.deploy(files["yours"])
    assert (cell.running, cell.deployed) == (["recognizer-2"], ["mine", "yours"])


def test_a_newcomer_that_one_of_two_fixtures_follows_goes_on_beside_the_old_one(
    cell: Cell, files: dict[str, Path], fixture_controller: Callable[..., Any]
) -> None:
    willing = fixture_controller(cell.bus, active="mine", instance="f")
    other = fixture_controller(cell.bus, active="mine", instance="g")
    other.refuses = True
    with pytest.raises(SwapError, match="f: follows yours; g: refused: not now"):
        cell.deploy(files["yours"])
    assert (willing.active, other.active) == ("yours", "mine")
    assert cell.running == ["recognizer-1"]


def test_what_a_stranger_says_that_it_follows_is_not_what_fixtures_follow(
    bus: Bus, stack: LocalStack, fixture_controller: Callable[..., Any]
) -> None:
    fixture_controller(bus, active="mine")
    key = bus.keys.rpc("fixture_controller", "x", "describe")
    said = Description(
        version="1", publishes=(), subscribes=(), answers=(), facts={"active_model": "other"}
    )
    stranger = Source(service="attacker", instance="x", boot="b")

    def pretend(query: zenoh.Query) -> None:
        with query:
            query.reply(key, encode(said, Envelope(source=stranger, seq=0)))

    with Bus.open(BusSettings(router=stack.router, cell=CELL), "stranger", "s") as other:
        other._declared.append(other._session.declare_queryable(key, pretend))
        assert active_model(bus) == "mine"


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_deploy_that_is_interrupted_from_outside_leaves_no_shadow(
    stack: LocalStack,
    bus: Bus,
    served: Served,
    files: dict[str, Path],
    fixture_controller: Callable[..., Any],
    eventually: Eventually,
    number: signal.Signals,
) -> None:
    fixture_controller(bus, active="human-shapes")
    name = load_model(files["mine"]).name
    command = [sys.executable, "-m", "hmcs_local.command", "deploy", str(files["mine"])]
    command += ["--router", stack.router, "--cell", CELL, "--folder", str(stack.folder)]

    def interrupted() -> None:
        process = subprocess.Popen(
            [*command, "--watch-s", "600"],
            env=dict(os.environ),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            eventually(lambda: bus.alive(Keys(CELL).member(name)), UP_WITHIN_S)
            process.send_signal(number)
            assert process.wait(UP_WITHIN_S) != 0
        finally:
            process.kill()
            process.wait()

    served(stack, interrupted)
    assert stack.instances("recognizer") == []
