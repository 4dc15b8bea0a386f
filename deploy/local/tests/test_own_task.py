from __future__ import annotations

import json
from pathlib import Path

import pytest

from hmcs.errors import UserError
from hmcs.recognition.learning import learn
from hmcs.recognition.model_file import save_model
from hmcs.task import load_task
from hmcs_local.bringing_up import Wanted, arrangement_of
from hmcs_local.compose import load_compose, own_compose
from hmcs_local.own_task import PAGE, arranged, input_environment, own_task, unheard
from support.lessons import lesson_task, performed

DATA = Path(__file__).parents[3] / "examples/data"
SPEC = load_compose(own_compose(), {})
SERVICES = tuple(name for name, spec in SPEC.services.items() if not spec.optional)
DEMO_ALONE = {"teach", "gesteme-classifier", "task-hmm"}


@pytest.fixture
def task(tmp_path: Path) -> Path:
    file = tmp_path / "mine.yaml"
    text = (DATA / "reach-and-lift.yaml").read_text(encoding="utf-8")
    file.write_text(text.replace("name: reach-and-lift", f"name: {lesson_task().name}"))
    return file


def model_of(kind: str, folder: Path) -> Path:
    file = folder / f"{kind}.hmcs"
    save_model(learn(lesson_task(), [performed(1), performed(2)], recognizer=kind), file)
    return file


def test_without_a_model_nothing_of_the_demo_runs_and_the_page_moves_the_hand(
    task: Path, tmp_path: Path
) -> None:
    own = own_task(str(task), load_task(task), model=None, source=PAGE, demonstrations=())
    services, environment = arranged(own, SPEC, tmp_path / "models", tmp_path / "recordings")
    assert set(services) == set(SERVICES) - DEMO_ALONE
    assert environment["input-device"]["HMCS_SOURCE"] == "page"
    assert environment["input-device"]["HMCS_DEMONSTRATION"] is None
    assert {changed["HMCS_TASK"] for changed in environment.values()} == {str(task)}
    assert set(environment) == set(SPEC.services)
    assert json.loads(environment["fixture-controller"]["HMCS_MODELS"] or "") == []
    # The trainer reads the task file though it lies in none of its folders.
    assert str(task) in json.loads(environment["trainer"]["HMCS_SOURCES"] or "")


@pytest.mark.parametrize(
    ("kind", "runs", "waits"),
    [("segment-filter", "task-hmm", "recognizer"), ("task-hmm", "recognizer", "task-hmm")],
)
def test_a_model_is_run_by_the_processes_of_its_kind(
    task: Path, tmp_path: Path, kind: str, runs: str, waits: str
) -> None:
    file = model_of(kind, tmp_path)
    own = own_task(str(task), load_task(task), model=file, source=PAGE, demonstrations=())
    services, environment = arranged(own, SPEC, tmp_path / "models", tmp_path / "recordings")
    assert environment[runs]["HMCS_MODEL"] == str(file)
    assert runs in services
    assert waits not in services or environment[waits]["HMCS_MODEL"] is None
    assert json.loads(environment["fixture-controller"]["HMCS_MODELS"] or "") == [str(file)]
    # Its guides are drawn though it lies in no folder of the stack.
    assert str(file) in json.loads(environment["console"]["HMCS_MODELS"] or "")


def test_a_model_of_another_task_is_refused(tmp_path: Path) -> None:
    file, other = model_of("task-hmm", tmp_path), DATA / "reach-and-lift.yaml"
    with pytest.raises(UserError, match=r"it is of the task 'lesson', not of 'reach-and-lift'"):
        own_task(str(other), load_task(other), model=file, source=PAGE, demonstrations=())


@pytest.mark.parametrize("source", ["synthetic", "simulated"])
def test_an_operator_who_follows_learned_paths_needs_a_model(source: str) -> None:
    with pytest.raises(UserError, match=f"--source {source}: .* give --model FILE"):
        input_environment(source, None, None)
    assert input_environment(source, "/m.hmcs", None)["HMCS_MODEL"] == "/m.hmcs"


def test_what_is_recorded_is_played_from_a_demonstration(task: Path) -> None:
    with pytest.raises(UserError, match="--source recorded: give the CSV file to play"):
        own_task(
            str(task), load_task(task), model=None, source="recorded", demonstrations=("take.mcap",)
        )
    own = own_task(
        str(task),
        load_task(task),
        model=None,
        source="recorded",
        demonstrations=("a.mcap", "b.csv"),
    )
    assert own.demonstration == Path("b.csv")


def test_the_demo_is_as_compose_yaml_has_it_but_for_another_source(tmp_path: Path) -> None:
    spec = load_compose(own_compose(), {})
    whole = arrangement_of(spec, tmp_path, Wanted(), lambda _: None)
    assert whole == (SERVICES, {})
    moved = arrangement_of(spec, tmp_path, Wanted(source=PAGE), lambda _: None)
    assert moved.services == SERVICES
    assert list(moved.environment) == ["input-device"]


@pytest.mark.parametrize(
    ("wanted", "problem"),
    [
        (Wanted(model=Path("m.hmcs")), "--model: name the task it is of"),
        (Wanted(recognizer="lhmm"), "--recognizer: name the task it is of"),
        (Wanted("t", ("a.csv",), Path("m.hmcs")), "--model and demonstrations: give the model, or"),
        (Wanted("t", recognizer="lhmm"), "--recognizer: it is learned from demonstrations"),
    ],
)
def test_what_does_not_go_together_is_refused_before_anything_is_read(
    wanted: Wanted, problem: str, tmp_path: Path
) -> None:
    spec = load_compose(own_compose(), {})
    with pytest.raises(UserError) as caught:
        arrangement_of(spec, tmp_path / "folder", wanted, lambda _: None)
    assert problem in str(caught.value)
    assert not (tmp_path / "folder").exists()


def test_variables_that_reach_nobody_are_found() -> None:
    spec = load_compose(own_compose(), {})
    environment = {"HMCS_SPEED": "2", "HMCS_CELL": "a", "HMCS_DEADLINE_MS": "9", "HOME": "/"}
    assert unheard(environment, spec.variables) == ["HMCS_SPEED"]
