from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from hmcs.bus.keys import Keys
from hmcs.bus.messages import Envelope, ModelFile, ModelQuestion, Source
from hmcs.bus.session import Answer
from hmcs.errors import UserError
from hmcs.recognition.learning import learn
from hmcs.recognition.model_file import load_model, save_model
from hmcs_local.model_fetching import fetch_models
from hmcs_local.stack import LocalStack
from support.lessons import lesson_task, performed

FREE = "tcp/127.0.0.1:0"


@pytest.fixture(scope="module")
def lesson(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("there") / "lesson.hmcs"
    save_model(learn(lesson_task(), [performed(1), performed(2)], recognizer="task-hmm"), file)
    return file


class OtherHost:
    """A bus on which a fixture controller has one model."""

    def __init__(self, name: str, content: bytes) -> None:
        self.keys = Keys("cell")
        self.settings = SimpleNamespace(cell="cell", router="tcp/there:7447")
        self._name, self._content = name, content

    def ask(self, _key: str, asked: ModelQuestion, _reply: Any, timeout_s: float) -> list[Any]:
        if asked.model != self._name:
            return []
        source = Source(service="fixture_controller", instance="there", boot="b")
        body = ModelFile(model=self._name, model_hash="h", content=self._content)
        return [Answer(Envelope(source=source, seq=0), body)]


def test_a_model_that_is_missing_comes_from_who_has_it(lesson: Path, tmp_path: Path) -> None:
    file = tmp_path / "models" / "lesson.hmcs"
    (line,) = fetch_models(OtherHost("lesson", lesson.read_bytes()), [file])  # type: ignore[arg-type]
    assert load_model(file).hash == load_model(lesson).hash
    assert line.endswith("from there")


@pytest.mark.parametrize("change", [lambda _: b"none", lambda content: content[:-100]])
def test_what_is_no_model_is_refused_and_nothing_is_written(
    lesson: Path, tmp_path: Path, change: Callable[[bytes], bytes]
) -> None:
    bus = OtherHost("lesson", change(lesson.read_bytes()))
    with pytest.raises(UserError, match="no model file, or a truncated one"):
        fetch_models(bus, [tmp_path / "lesson.hmcs"])  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_a_model_of_another_name_than_asked_for_is_refused(lesson: Path, tmp_path: Path) -> None:
    bus = OtherHost("other", lesson.read_bytes())
    with pytest.raises(UserError, match="there has sent the model 'lesson'"):
        fetch_models(bus, [tmp_path / "other.hmcs"])  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["unknown", "no name"])
def test_a_model_that_nobody_has_is_an_error_with_what_to_do(name: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="start the one that has it first, or copy the file here"):
        fetch_models(OtherHost("lesson", b""), [tmp_path / f"{name}.hmcs"])  # type: ignore[arg-type]


@pytest.fixture
def asked(
    write_compose: Callable[..., Path], service: Callable[..., dict[str, Any]], tmp_path: Path
) -> Callable[..., list[Path]]:
    """Starts a stack with one service; returns the model files it asked for."""

    def start(environment: dict[str, str], **more: Any) -> list[Path]:
        files: list[Path] = []
        path = write_compose(a=service(environment=environment), **more)
        with LocalStack(
            path, router=FREE, folder=tmp_path, fetch=lambda _router, missing: files.extend(missing)
        ):
            pass
        return files

    return start


def test_a_stack_asks_for_the_model_files_that_are_not_there(
    asked: Callable[..., list[Path]], tmp_path: Path
) -> None:
    there = tmp_path / "there.hmcs"
    there.touch()
    gone = str(tmp_path / "gone.hmcs")
    assert asked({"HMCS_MODEL": gone}) == [Path(gone)]
    assert asked({"HMCS_MODELS": f'["{there}", "{gone}", "{tmp_path}"]'}) == [Path(gone)]
    assert asked({"HMCS_MODEL": str(there)}) == []
    assert asked({"HMCS_MODEL": ""}) == []
