"""A newcomer takes over or goes again, whatever comes in between."""

from __future__ import annotations

import fcntl
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zenoh

from hmcs.bus.keys import ANY, Keys
from hmcs.bus.messages import Ask, Description, Envelope, Source
from hmcs.bus.session import Bus, BusSettings
from hmcs.bus.wire import encode
from hmcs.recognition.model_file import load_model, save_model
from hmcs.task import Task
from hmcs_local import deploying, swap
from hmcs_local.connecting import open_operator
from hmcs_local.control import Control, ControlError
from hmcs_local.deploying import (
    Agreement,
    Deployed,
    DeployError,
    History,
    active_model,
    back,
    deploy,
    read_history,
    write_history,
)
from hmcs_local.stack import LocalStack
from hmcs_local.swap import PartlySwappedError, SwapError
from support.made_up import line_model

Describe = Callable[..., dict[str, Any]]
Eventually = Callable[[Callable[[], Any]], Any]
Served = Callable[[LocalStack, Callable[[], Any]], Any]
CELL = "deployed"
UP_WITHIN_S = 240.0
"""A real recognizer is up by then, however busy the machine is."""
TASK = {
    "format": "hmcs-task/1",
    "name": "t",
    "dead_zone_m": 0.005,
    "gestemes": [{"name": "g"}],
    "states": [{"name": "s", "gestemes": ["g"], "next": {}}],
    "start": {"s": 1.0},
    "workspace": {"lower_m": [-1, -1, 0], "upper_m": [1, 1, 1]},
    "robot": {
        "model": "puma560",
        "tool_start_m": [0.6, 0, 0.5],
        "tool_orientation_xyzw": [0, 0, 0, 1],
    },
}


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


class Cell:
    """What `hmcs deploy` is asked here, what it tells, and what runs then."""

    def __init__(self, stack: LocalStack, bus: Bus, served: Served) -> None:
        self.stack, self.bus, self._served = stack, bus, served
        self.folder = stack.folder
        self.told: list[str] = []

    def deploy(self, file: Path) -> None:
        self._raised(lambda: deploy(self.bus, Control(self.folder), self.folder, file, **self._how))

    def back(self) -> None:
        self._raised(lambda: back(self.bus, Control(self.folder), self.folder, self.told.append))

    @property
    def _how(self) -> dict[str, Any]:
        return {"watch_s": 0.0, "tell": self.told.append}

    def _raised(self, act: Callable[[], Any]) -> None:
        def aside() -> BaseException | None:
            try:
                act()
            except BaseException as error:  # an interrupt does not leave a thread
                return error
            return None

        error = self._served(self.stack, aside)
        if error is not None:
            raise error

    @property
    def running(self) -> list[str]:
        return [process.instance for process in self.stack.instances("recognizer")]

    @property
    def deployed(self) -> list[str]:
        return [each.model for each in read_history(self.folder).deployed]


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
        assert cell.told[-1].endswith("is stopped again")
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


def test_what_a_killed_deploy_has_left_is_stopped_by_the_next_one(
    cell: Cell, files: dict[str, Path], fixture_controller: Callable[..., Any]
) -> None:
    fixture = fixture_controller(cell.bus, active="human-shapes")
    command = [sys.executable, "-m", "hmcs_recognizer", "--model", str(files["mine"].resolve())]
    left = cell.stack.start("recognizer", command=command).instance
    shadow = Deployed(model="mine", path=str(files["mine"].resolve()), instance=left)
    write_history(cell.folder, History(shadow=shadow))
    cell.deploy(files["mine"])
    assert (fixture.active, cell.running) == ("mine", ["recognizer-2"])
    assert cell.told[0].startswith(f"{left} stopped")


def test_what_runs_under_a_name_of_an_earlier_up_is_nobodys_to_stop(
    cell: Cell, files: dict[str, Path], fixture_controller: Callable[..., Any]
) -> None:
    fixture_controller(cell.bus, active="human-shapes")
    other = cell.stack.start("recognizer").instance
    shadow = Deployed(model="mine", path=str(files["mine"].resolve()), instance=other)
    write_history(cell.folder, History(shadow=shadow))
    cell.deploy(files["yours"])
    assert cell.running == [other, "recognizer-2"]


@pytest.mark.parametrize("refuses", [False, True])
def test_one_that_runs_that_very_model_already_is_taken_and_left_as_it_is(
    cell: Cell,
    files: dict[str, Path],
    fixture_controller: Callable[..., Any],
    eventually: Eventually,
    refuses: bool,
) -> None:
    fixture = fixture_controller(cell.bus, active="human-shapes")
    fixture.refuses = refuses
    command = [sys.executable, "-m", "hmcs_recognizer", "--model", str(files["mine"])]
    there = cell.stack.start("recognizer", command=command).instance
    member = cell.bus.keys.member("mine", ANY, there)
    eventually(lambda: cell.bus.alive(member) and described(cell.bus, there), UP_WITHIN_S)
    with suppress(SwapError):
        cell.deploy(files["mine"])
    assert cell.running == [there]
    assert fixture.active == ("human-shapes" if refuses else "mine")
    if not refuses:
        cell.deploy(files["yours"])
        assert cell.running == [there, "recognizer-2"]


def described(bus: Bus, instance: str) -> bool:
    return bool(bus.ask(bus.keys.rpc("recognizer", instance, "describe"), Ask(), Description))


def test_another_model_of_the_name_that_is_run_is_a_reason_not_to_begin(
    cell: Cell,
    files: dict[str, Path],
    fixture_controller: Callable[..., Any],
    eventually: Eventually,
) -> None:
    fixture = fixture_controller(cell.bus, active="human-shapes")
    command = [sys.executable, "-m", "hmcs_recognizer", "--model", str(files["2"])]
    there = cell.stack.start("recognizer", command=command).instance
    eventually(
        lambda: cell.bus.alive(cell.bus.keys.member("mine")) and described(cell.bus, there),
        UP_WITHIN_S,
    )
    with pytest.raises(DeployError, match=f"{there} runs another model of the name 'mine'"):
        cell.deploy(files["mine"])
    assert (cell.running, fixture.asked) == ([there], [])


def test_a_member_token_with_nobody_behind_it_is_no_reason_not_to_begin(
    cell: Cell,
    files: dict[str, Path],
    fixture_controller: Callable[..., Any],
    eventually: Eventually,
) -> None:
    fixture = fixture_controller(cell.bus, active="human-shapes")
    cell.bus.announce(cell.bus.keys.member("mine", "recognizer", "ghost"))
    eventually(lambda: cell.bus.alive(cell.bus.keys.member("mine")))
    cell.deploy(files["mine"])
    assert fixture.active == "mine"


def test_a_fixture_that_does_not_answer_keeps_the_old_one_running_beside_the_new_one(
    cell: Cell,
    files: dict[str, Path],
    fixture_controller: Callable[..., Any],
    eventually: Eventually,
) -> None:
    fixture = fixture_controller(cell.bus, active="human-shapes")
    cell.deploy(files["mine"])
    cell.bus.announce(cell.bus.keys.presence("fixture_controller", "a-ghost"))
    eventually(lambda: len(cell.bus.alive(cell.bus.keys.presence("fixture_controller"))) == 2)
    with pytest.raises(PartlySwappedError, match="a-ghost: did not answer"):
        cell.deploy(files["yours"])
    assert fixture.active == "yours"
    assert cell.running == ["recognizer-1", "recognizer-2"]
    assert cell.deployed == ["human-shapes", "mine", "yours"]


def test_a_second_deploy_at_the_same_time_is_refused(
    cell: Cell, files: dict[str, Path], fixture_controller: Callable[..., Any]
) -> None:
    fixture = fixture_controller(cell.bus)
    with (cell.folder / ".deploying").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with pytest.raises(DeployError, match="another `hmcs deploy` is at work"):
            cell.deploy(files["mine"])
    assert (cell.running, fixture.asked) == ([], [])
    cell.deploy(files["mine"])


def test_without_an_up_in_the_folder_nothing_is_begun(
    bus: Bus, files: dict[str, Path], fixture_controller: Callable[..., Any], tmp_path: Path
) -> None:
    fixture = fixture_controller(bus)
    folder = tmp_path / "elsewhere"
    with pytest.raises(ControlError, match="no `hmcs up` works in"):
        deploy(bus, Control(folder), folder, files["mine"], watch_s=0.0)
    assert fixture.asked == []
    assert not folder.exists()


def test_fixtures_that_follow_different_models_are_no_reason_to_guess(
    bus: Bus, fixture_controller: Callable[..., Any]
) -> None:
    with pytest.raises(DeployError, match="no fixture controller"):
        active_model(bus)
    fixture_controller(bus, active="mine", instance="f")
    assert active_model(bus) == "mine"
    fixture_controller(bus, active="", instance="g")
    with pytest.raises(DeployError, match="f mine, g none"):
        active_model(bus)


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
