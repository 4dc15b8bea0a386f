"""A deploy beside whatever runs, follows or answers there already."""

from __future__ import annotations

import fcntl
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from hmcs.bus.keys import ANY
from hmcs.bus.session import Bus
from hmcs_local.control import Control, ControlError
from hmcs_local.deploying import Deployed, DeployError, History, active_model, deploy, write_history
from hmcs_local.swap import PartlySwappedError, SwapError
from support.deployed import UP_WITHIN_S, Cell, Eventually, described


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
    assert cell.reported[0].startswith(f"{left} stopped")


def test_what_runs_under_a_name_of_an_earlier_up_is_nobodys_to_stop(
    cell: Cell, files: dict[str, Path], fixture_controller: Callable[..., Any]
) -> None:
    fixture_controller(cell.bus, active="human-shapes")
    other = cell.stack.start("recognizer").instance
    shadow = Deployed(model="mine", path=str(files["mine"].resolve()), instance=other)
    write_history(cell.folder, History(shadow=shadow))
    cell.deploy(files["yours"])
    assert cell.running == [other, "recognizer-2"]


@pytest.mark.long
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


@pytest.mark.long
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
