"""The service over a real router, pumped by the test."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hmcs.bus.messages import (
    ActivateRecognizer,
    Done,
    LastSteps,
    LoadModel,
    ModelFile,
    ModelQuestion,
    RobotState,
    Step,
)
from hmcs.bus.service import UserError
from hmcs.recognition.model_file import load_model

MakeCell = Callable[..., Any]
MakeModel = Callable[..., Path]


def test_before_anybody_drives_the_robot_is_commanded_to_stand(make_cell: MakeCell) -> None:
    cell = make_cell()
    cell.until(lambda: len(cell.commands) > 3, "the stop again and again")
    assert {command.engaged for command, _ in cell.commands} == {False}
    assert {state.reason for state in cell.states} == {"input_stale"}
    assert cell.service.health() == (True, "idle: no operator input; follows no model")


def test_each_sample_becomes_a_command_with_its_origin(make_cell: MakeCell) -> None:
    cell = make_cell()
    cell.engage()
    command, origin = cell.drive()
    assert_allclose(command.twist, [0.1, 0.1, 0, 0, 0, 0])
    assert command.valid_for_ns == 80_000_000
    assert origin == cell.device.origin(captured_ns=3)
    assert cell.states[-1].reason == "no_belief"


def test_a_sure_belief_stiffens_the_fixture_along_the_learned_path(
    make_cell: MakeCell, make_model: MakeModel
) -> None:
    path = make_model()
    cell = make_cell(models=(path,))
    cell.engage()
    state = cell.guide_until_stiff(load_model(path).hash)
    assert (state.reason, state.state, state.model, state.law) == (
        "guiding",
        "only",
        "lines",
        "general",
    )
    assert state.factor == pytest.approx(0.8)
    assert state.compliance == pytest.approx(0.25)
    assert_allclose(state.preferred_direction, [1, 0, 0], atol=1e-9)
    assert_allclose(cell.commands[-1][0].twist, [0.1, 0.025, 0, 0, 0, 0], atol=1e-9)
    assert_allclose(state.wrench, [0, -1.5, 0, 0, 0, 0], atol=1e-9)
    assert cell.service.facts()["active_model"] == "lines"


def test_silence_of_the_operator_commands_zero_until_a_deliberate_re_engage(
    make_cell: MakeCell,
) -> None:
    cell = make_cell(settle_ms=0, input_stale_after_ms=100)
    cell.engage()
    cell.until(lambda: not cell.commands[-1][0].engaged, "the stop")
    assert not cell.commands[-1][0].twist.any()
    assert cell.commands[-1][1] is None
    assert not cell.drive()[0].engaged
    assert not cell.drive()[0].engaged
    cell.engage()


def test_a_second_input_device_is_refused_and_counted(make_cell: MakeCell) -> None:
    cell = make_cell()
    first, second = cell.device, type(cell.device)(cell.open_bus("input_device"))
    cell.engage()
    refused = cell.bus.counters.refused

    def both_drive() -> bool:
        second.move(velocity=(0.0, 0.0, 0.2))
        cell.drive()
        return bool(refused["motion"] > 2)

    cell.until(both_drive, "the refusal")
    assert not any(command.twist[2] for command, _ in cell.commands)
    second.make_step(0)
    cell.until(lambda: cell.drive() and refused["step"] == 1, "the refusal of its step")
    assert first.bus.source.boot != second.bus.source.boot


@pytest.mark.parametrize(
    ("fields", "counted"),
    [
        ({"model_hash": "another"}, "refused"),
        ({"states": (), "probabilities": np.zeros(0)}, "refused"),
        ({"states": ("only", "more")}, "refused"),
        ({"clock": "another"}, "late"),
    ],
)
def test_a_belief_that_does_not_fit_is_counted_and_guides_nothing(
    make_cell: MakeCell, make_model: MakeModel, fields: dict[str, object], counted: str
) -> None:
    path = make_model()
    cell = make_cell(models=(path,))
    cell.engage()
    said = {"model_hash": load_model(path).hash} | fields
    assert cell.guide(**said).reason == "no_belief"
    assert cell.guide(**said).reason == "no_belief"
    assert getattr(cell.bus.counters, counted)["belief"] == 2


def test_a_belief_of_a_model_that_is_not_loaded_is_refused(
    make_cell: MakeCell, make_model: MakeModel
) -> None:
    cell = make_cell(models=(make_model("circles"),))
    cell.engage()
    assert cell.guide("whatever").reason == "no_belief"
    assert cell.bus.counters.refused["belief"] == 1


def test_a_recognizer_of_another_name_may_stand_on_a_loaded_model(
    make_cell: MakeCell, make_model: MakeModel
) -> None:
    path = make_model("lines")
    cell = make_cell(models=(path,), active_model="lines")
    cell.engage()
    assert cell.guide(load_model(path).hash, recognizer="mine").reason == "no_belief"
    cell.ask("activate", ActivateRecognizer(model="mine"), Done)
    cell.drive()
    assert (cell.states[-1].reason, cell.states[-1].model) == ("guiding", "mine")


def test_a_step_that_jumps_back_is_refused(make_cell: MakeCell) -> None:
    cell = make_cell()
    cell.engage()
    for index in (0, 1, 1, 0, 2):
        cell.device.step = index
        cell.device.make_step(0)
    cell.until(lambda: cell.bus.counters.received["step"] == 5, "the steps")
    assert cell.bus.counters.refused["step"] == 2


def test_a_recognizer_is_loaded_and_activated_on_demand(
    make_cell: MakeCell, make_model: MakeModel
) -> None:
    cell = make_cell(models=(make_model("circles"),), active_model="circles")
    path = make_model("lines", folder="more")
    hash_ = load_model(path).hash
    refusal = cell.ask("activate", ActivateRecognizer(model="lines"), Done)
    assert "'lines' is not loaded; loaded: circles" in str(refusal)
    loaded = cell.ask("load_model", LoadModel(path=str(path)), Done)
    assert loaded.detail == f"model lines {hash_} is loaded"
    cell.engage()
    assert cell.guide(hash_).reason == "no_belief"
    activated = cell.ask("activate", ActivateRecognizer(model="lines"), Done)
    assert activated.detail == f"follows lines {hash_}"
    cell.drive()
    assert (cell.states[-1].reason, cell.states[-1].model) == ("guiding", "lines")


def test_a_model_of_another_task_than_the_followed_one_is_reported(
    make_cell: MakeCell, make_model: MakeModel
) -> None:
    cell = make_cell(models=(make_model("circles"),), active_model="circles")
    other = make_model("lines", folder="more", of_task="welding")
    loaded = cell.ask("load_model", LoadModel(path=str(other)), Done)
    assert "it is of task 'welding', the followed one of 'one-line'" in loaded.detail
    assert cell.service.facts()["active_model"] == "circles"


def test_a_model_file_that_cannot_be_used_is_refused_and_nothing_changes(
    make_cell: MakeCell, make_model: MakeModel, tmp_path: Path
) -> None:
    cell = make_cell(models=(make_model(),))
    refusal = cell.ask("load_model", LoadModel(path=str(tmp_path / "none.hmcs")), Done)
    assert "no such model file" in str(refusal)
    assert cell.service.facts()["models"].startswith("lines ")


def test_the_file_of_a_loaded_model_is_handed_over_whole(
    make_cell: MakeCell, make_model: MakeModel
) -> None:
    file = make_model()
    cell = make_cell(models=(file,))
    answer = cell.ask("model_file", ModelQuestion(model="lines"), ModelFile)
    assert answer.content == file.read_bytes()
    assert answer.model_hash == load_model(file).hash
    assert "model 'squares' is not loaded here" in str(
        cell.ask("model_file", ModelQuestion(model="squares"), ModelFile)
    )


def test_a_file_that_holds_another_model_by_now_is_not_handed_over(
    make_cell: MakeCell, make_model: MakeModel
) -> None:
    file = make_model()
    cell = make_cell(models=(file,))
    file.write_bytes(make_model("lines", folder="more", of_task="welding").read_bytes())
    refusal = cell.ask("model_file", ModelQuestion(model="lines"), ModelFile)
    assert "holds another model now than the one that is loaded" in str(refusal)


@pytest.mark.parametrize("name", ["there.txt", "nowhere.txt", ""])
def test_of_a_file_that_is_no_model_nobody_on_the_bus_learns_whether_it_exists(
    make_cell: MakeCell, make_model: MakeModel, tmp_path: Path, name: str
) -> None:
    cell = make_cell(models=(make_model(),))
    (tmp_path / "there.txt").write_text("secret")
    path = str(tmp_path / name)
    refusal = cell.ask("load_model", LoadModel(path=path), Done)
    assert f"{path!r}: not a model: name a file that ends in .hmcs" in str(refusal)


def test_a_model_to_follow_that_is_not_there_is_a_users_mistake(
    make_cell: MakeCell, make_model: MakeModel
) -> None:
    with pytest.raises(UserError, match="'squares' is not loaded; loaded: lines"):
        make_cell(models=(make_model(),), active_model="squares")


def test_a_controller_that_comes_late_knows_the_origin_of_the_segment(
    make_cell: MakeCell, make_model: MakeModel
) -> None:
    path = make_model()
    cell = make_cell(models=(path,))
    device = cell.device
    steps = tuple(
        Step(index=i, position=np.array([i * 1e-3, 0, 0]), displacement=np.array([1e-3, 0, 0]))
        for i in range(100)
    )
    last = LastSteps(clock=device.bus.source.boot, steps=steps, origins=(device.origin(),) * 100)
    cell.service.take_past_steps(last, device.bus.source)
    device.step = 100
    cell.engage()
    state = cell.guide_until_stiff(load_model(path).hash)
    assert state.reason == "guiding"
    assert state.progress > 0.15


def test_the_robots_stop_shows_in_health(make_cell: MakeCell) -> None:
    cell = make_cell()
    cell.robot_states.put(
        RobotState(
            robot="puma560",
            joint_positions=np.zeros(6),
            joint_velocities=np.zeros(6),
            tool_position=np.zeros(3),
            tool_orientation=np.array([0.0, 0, 0, 1]),
            tool_twist=np.zeros(6),
            reference_twist=np.zeros(6),
            nearest_obstacle="",
            nearest_distance_m=None,
            contacts=("table",),
            stop="collision",
            limited=(),
        )
    )
    cell.until(lambda: cell.bus.counters.received["robot_state"], "the robot's state")
    assert "puma560 stands: collision" in cell.service.health()[1]
