"""What the tests over a real router begin with."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from hmcs.motion.demonstrations import read_csv
from hmcs.motion.steps import Step, steps_of
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model
from hmcs.task import load_task
from hmcs_trainer.performance import perform
from hmcs_trainer.training import train
from support.hand import Scene
from support.stack import Stack

TASK = "human-shapes"
SHAPES = ("GShape", "NShape", "PShape", "JShape", "Snake")


@pytest.fixture(scope="session")
def model_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model of the demo task, learned from five drawings of each shape."""
    path = tmp_path_factory.mktemp("model") / f"{TASK}.hmcs"
    train(TASK, [f"lasa:{shape}/1-5" for shape in SHAPES], path)
    return path


@pytest.fixture(scope="session")
def other_model_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Another model of the same name, learned from three drawings of each shape."""
    path = tmp_path_factory.mktemp("other") / f"{TASK}.hmcs"
    train(TASK, [f"lasa:{shape}/1-3" for shape in SHAPES], path)
    return path


@pytest.fixture(scope="session")
def shadow_model_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model of the same task under another name."""
    path = tmp_path_factory.mktemp("shadow") / "shadow.hmcs"
    train(TASK, [f"lasa:{shape}/2-4" for shape in SHAPES], path, name="shadow")
    return path


@pytest.fixture(scope="session")
def model(model_file: Path) -> Model:
    return load_model(model_file)


@pytest.fixture(scope="session")
def performance_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two rounds of the task, chained of the drawings the model has not seen."""
    path = tmp_path_factory.mktemp("performance") / "operator.csv"
    perform(load_task(TASK), [f"lasa:{shape}/{k}" for k in (6, 7) for shape in SHAPES], path)
    return path


@pytest.fixture(scope="session")
def steps(performance_file: Path) -> list[Step]:
    """The steps of that performance."""
    return steps_of(read_csv(performance_file).positions, load_task(TASK).dead_zone_m)


@pytest.fixture
def stack(tmp_path: Path) -> Iterator[Stack]:
    with Stack(tmp_path / "logs") as running:
        yield running


@pytest.fixture
def scene(stack: Stack) -> Scene:
    return Scene(stack)
