"""Which model the processes of the layered recognizer start with."""

from __future__ import annotations

from pathlib import Path

import pytest

from hmcs.errors import NothingToDoError, UserError
from hmcs.layered_start import layered_model
from hmcs.recognition.learning import learn
from hmcs.recognition.model_file import ModelFileError, model_file_of, save_model
from support.lessons import lesson_task, performed

TASK = "human-shapes"


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two folders: `layered` and `other` hold a model under the name of the task."""
    folder = tmp_path_factory.mktemp("models")
    for name, kind in (("layered", "segment-filter"), ("other", "task-hmm")):
        model = learn(lesson_task(), [performed(1), performed(2)], recognizer=kind)
        save_model(model, folder / name / f"{TASK}.hmcs")
    return folder


def test_a_file_is_taken_and_of_a_folder_the_one_named_as_the_task(models: Path) -> None:
    file = models / "layered" / f"{TASK}.hmcs"
    assert model_file_of(file, None) == model_file_of(file.parent, TASK) == file
    assert layered_model(file.parent, TASK, None).hash == layered_model(file, None, None).hash


def test_a_task_is_named_by_its_file_too(models: Path, tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "examples/data/reach-and-lift.yaml").read_text()
    (tmp_path / "any.yaml").write_text(text.replace("name: reach-and-lift", f"name: {TASK}"))
    file = model_file_of(models / "layered", str(tmp_path / "any.yaml"))
    assert file == models / "layered" / f"{TASK}.hmcs"


def test_a_folder_without_the_tasks_model_leaves_nothing_to_do(models: Path) -> None:
    assert model_file_of(models, TASK) is None
    with pytest.raises(NothingToDoError, match=f"holds no model of the task {TASK}"):
        layered_model(models, TASK, None)


def test_a_model_of_another_kind_in_a_folder_is_left_to_recognizer_processes(models: Path) -> None:
    with pytest.raises(NothingToDoError, match=r"kind 'task-hmm'.* recognizer processes"):
        layered_model(models / "other", TASK, None)
    # Somebody who names the file means it: the process says what is wrong with it.
    assert layered_model(models / "other" / f"{TASK}.hmcs", None, None).recognizer == "task-hmm"


def test_a_folder_without_a_task_and_a_file_that_is_not_there_are_mistakes(models: Path) -> None:
    with pytest.raises(UserError, match="name the task whose model it is to be"):
        model_file_of(models, None)
    with pytest.raises(ModelFileError, match="no such model file"):
        layered_model(models / "gone.hmcs", TASK, None)
