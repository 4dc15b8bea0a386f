"""A model that is followed and lies in no folder here is fetched: its task and guides are shown."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hmcs.bus.messages import FixtureState, ModelFile, ModelQuestion
from hmcs.bus.session import RequestRefusedError
from hmcs.recognition.model_file import load_model, save_model
from hmcs_console.fetching import AGAIN_AFTER_S, Fetching
from hmcs_console.seeing.models import Models
from support.texts import EXAMPLE_OF

LOG = logging.getLogger("test")


class Controller:
    """A fixture controller that has a model loaded which lies nowhere else."""

    def __init__(self, make_process: Callable[..., Any], cell: Any, file: Path) -> None:
        self.model = save_model(load_model(file)._replace(name="far"), file.parent.parent / "x")
        self.content = (file.parent.parent / "x").read_bytes()
        self.asked: list[str] = []
        answers = {"model_file": (ModelQuestion, self.answer)}
        make_process(cell, "fixture_controller", "f", answers)

    def answer(self, question: ModelQuestion) -> ModelFile:
        self.asked.append(question.model)
        if question.model != "far":
            raise RequestRefusedError("not loaded here")
        return ModelFile(model="far", model_hash=self.model.hash, content=self.content)


def follow(cell: Any, model: str) -> None:
    state: Any = EXAMPLE_OF[FixtureState].model_copy(update={"model": model})
    cell.service._seen.fixture_changed(time.monotonic(), state)


def task_tab(cell: Any) -> str:
    return str(cell.service._view._explained._rules.content)


def test_the_task_of_a_deployed_model_is_shown_wherever_its_file_lies(
    make_cell: Callable[..., Any], make_process: Callable[..., Any], model_file: Path
) -> None:
    cell = make_cell(task="human-shapes")
    cell.until(lambda: "human-shapes" in task_tab(cell), "the stack's own task")
    controller = Controller(make_process, cell, model_file)

    def shown() -> bool:
        follow(cell, "far")
        return "made-up" in task_tab(cell)

    cell.until(shown, "the task of the model that is followed")
    assert controller.asked == ["far"]


def test_a_model_that_nobody_sends_is_asked_for_seldom(
    make_cell: Callable[..., Any], make_process: Callable[..., Any], model_file: Path
) -> None:
    cell = make_cell()
    controller = Controller(make_process, cell, model_file)
    now_s = [0.0]
    models = Models((), (), LOG)
    fetching = Fetching(cell.service._asking, cell.service._seen, models, lambda: now_s[0])
    cell.until(lambda: cell.service._seen.members, "the fixture controller")
    assert models.find("gone", "") is None
    for _ in range(6):
        fetching.ask()
        now_s[0] += AGAIN_AFTER_S / 4.5
    cell.until(lambda: len(controller.asked) == 2, "two questions")
    models.find("", "")
    fetching.ask()
    cell.wait(0.1)
    assert len(controller.asked) == 2


@pytest.mark.parametrize("content", [b"", b"no model", b"PK\x03\x04" + b"x" * 1000])
def test_what_is_no_model_is_not_taken_in(content: bytes) -> None:
    models = Models((), (), LOG)
    models.give(content)
    assert models.find("far", "hash") is None
    assert models.wanted == ("far", "hash")
