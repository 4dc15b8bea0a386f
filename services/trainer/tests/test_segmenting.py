"""The trainer finds the parts of a recording by a model, when somebody asks over the bus."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import Label, ModelFile, ModelQuestion, Motion, Segmentation, SegmentQuestion
from hmcs.bus.session import RequestRefusedError
from hmcs.bus.verbs import MODEL_FILE, SEGMENT
from hmcs.errors import UserError
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import save_model
from hmcs.recordings.demonstrations import performances_of
from hmcs.recordings.labels import labels_beside
from hmcs.recordings.reading import read
from hmcs_trainer import segmenting
from hmcs_trainer.segment_job import SegmentJob, found_in
from hmcs_trainer.segmenting import Segmenting, file_with_hash
from hmcs_trainer.service import Trainer
from hmcs_trainer.settings import TrainerSettings
from support.lessons import ROUND, lesson_task, performed
from support.recordings import KEYS, Maker
from support.stack import Stack

LOG = logging.getLogger("test")


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Model, Path]:
    file = tmp_path_factory.mktemp("learned") / "m.hmcs"
    return save_model(learn(lesson_task(), [performed(seed) for seed in range(4)]), file), file


def take(folder: Path, name: str = "take", labels: tuple[str, ...] = ()) -> Path:
    shown = performed(9)
    said = [
        (KEYS.motion, Motion(position=at, velocity=np.zeros(3), dead_man=True))
        for at in shown.positions
    ]
    return Maker(folder).write([*((KEYS.label, Label(state=each)) for each in labels), *said], name)


def question(model: Model, recording: Path | str) -> SegmentQuestion:
    return SegmentQuestion(recording=str(recording), model=model.name, model_hash=model.hash)


class Bench:
    """A trainer, and somebody who asks."""

    def __init__(self, stack: Stack, folder: Path) -> None:
        self.stack, self.takes = stack, folder / "takes"
        self.takes.mkdir()
        self.models = folder / "models"
        self.asker = stack.open_bus("console", "page")
        bus = stack.open_bus("trainer", "here")
        settings = TrainerSettings(folder=self.models, sources=(self.takes,))
        self.trainer = Trainer(settings, bus, LOG)
        self.trainer.start()

    def asked(self, asking: SegmentQuestion) -> Segmentation:
        with ThreadPoolExecutor(1) as aside:
            coming = aside.submit(SEGMENT.ask, self.asker, asking, instance="here", timeout_s=60.0)
            self.stack.until(coming.done)
        (got,) = coming.result()
        return got.body


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    with Stack(tmp_path) as stack:
        made = Bench(stack, tmp_path)
        yield made
        made.trainer.close()


def test_the_parts_of_a_recording_are_those_its_hand_went_through(
    bench: Bench, learned: tuple[Model, Path]
) -> None:
    model, file = learned
    bench.models.mkdir()
    (bench.models / "other-name.hmcs").write_bytes(file.read_bytes())
    recording = take(bench.takes)
    found = bench.asked(question(model, recording))
    assert found.recording == recording.name
    assert found.model == model.name
    assert found.states == ROUND
    assert (found.end_s[:-1] <= found.begin_s[1:]).all()
    true_s = performed(9).time_s[np.flatnonzero(performed(9).switches[1:]) + 1]
    assert found.begin_s[1:] == pytest.approx(true_s, abs=0.2)
    assert (found.probability > 0.5).all()


def test_a_model_of_elsewhere_is_fetched_from_the_fixture_controller_that_has_it(
    bench: Bench, learned: tuple[Model, Path]
) -> None:
    model, file = learned
    fixture = bench.stack.open_bus("fixture_controller", "f")
    content = ModelFile(model=model.name, model_hash=model.hash, content=file.read_bytes())
    asked: list[ModelQuestion] = []

    def answer(question: ModelQuestion) -> ModelFile:
        asked.append(question)
        return content

    MODEL_FILE.answer(fixture, answer)
    found = bench.asked(question(model, take(bench.takes)))
    assert found.states == ROUND
    assert asked == [ModelQuestion(model=model.name)]


def test_what_is_no_recording_of_the_trainers_folders_is_refused(
    bench: Bench, learned: tuple[Model, Path], tmp_path: Path
) -> None:
    outside = take(tmp_path / "outside")
    for named in (outside, "../outside/take.mcap", "gone.mcap", "/etc/passwd", "take.csv"):
        with pytest.raises(RequestRefusedError, match=r"is no file in|is not a recording"):
            bench.asked(question(learned[0], named))


def test_a_model_that_nobody_has_is_refused(bench: Bench) -> None:
    recording = take(bench.takes)
    with pytest.raises(RequestRefusedError, match=r"'0000' is no file .*no fixture controller"):
        bench.asked(SegmentQuestion(recording=str(recording), model="m", model_hash="0000"))


# --- what is refused by what is in it -------------------------------------------------------------


def found_error(recording: Path, model: Path) -> str:
    with pytest.raises(UserError) as raised:
        found_in(SegmentJob(recording=recording, model=model))
    return str(raised.value)


def test_a_recording_with_labels_of_another_task_is_refused(
    learned: tuple[Model, Path], tmp_path: Path
) -> None:
    recording = take(tmp_path, labels=("secret-state",))
    said = found_error(recording, learned[1])
    assert "labels that are no states of the model's task 'lesson'" in said
    assert "secret-state" not in said


def test_labels_written_beside_it_count_as_those_said(
    learned: tuple[Model, Path], tmp_path: Path
) -> None:
    recording = take(tmp_path)
    labels_beside(recording).write_text("begin_s,end_s,state\n0.1,0.5,other\n", encoding="utf-8")
    assert "no states of the model's task" in found_error(recording, learned[1])
    labels_beside(recording).write_text("begin_s,end_s,state\n0.1,0.5,turn\n", encoding="utf-8")
    assert found_in(SegmentJob(recording=recording, model=learned[1])).segments


def test_a_model_of_a_kind_without_offline_segmentation_is_refused(tmp_path: Path) -> None:
    model = save_model(
        learn(lesson_task(), [performed(seed) for seed in range(3)], recognizer="directions"),
        tmp_path / "d.hmcs",
    )
    assert model.recognizer == "directions"
    said = found_error(take(tmp_path), tmp_path / "d.hmcs")
    assert "no offline segmentation" in said
    assert "segment-filter" in said


def test_a_recording_without_motion_is_refused(learned: tuple[Model, Path], tmp_path: Path) -> None:
    idle = [(KEYS.motion, Motion(position=np.zeros(3), velocity=np.zeros(3), dead_man=False))]
    recording = Maker(tmp_path).write(idle)
    assert "no motion of a hand" in found_error(recording, learned[1])


def test_the_times_are_those_of_the_outline(learned: tuple[Model, Path], tmp_path: Path) -> None:
    recording = take(tmp_path)
    (performance,) = performances_of(read(recording))
    segments = found_in(SegmentJob(recording=recording, model=learned[1])).segments
    assert segments[0].begin_s == performance.time_s[0]
    assert segments[-1].end_s == performance.time_s[-1]


# --- its process ----------------------------------------------------------------------------------


def by(folder: Path, **changed: Any) -> Segmenting:
    given = {"longest_s": 30.0, "fetch": lambda _: None, "log": LOG} | changed
    return Segmenting(folder, (), **given)


def test_one_that_takes_too_long_is_given_up_and_the_next_may(
    learned: tuple[Model, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "m.hmcs").write_bytes(learned[1].read_bytes())
    asked = question(learned[0], take(tmp_path))
    hung = by(tmp_path, longest_s=0.1)
    with monkeypatch.context() as patched:
        patched.setattr(segmenting, "_COMMAND", ("sleep", "60"))
        for _ in range(2):
            with pytest.raises(RequestRefusedError, match="given up, it took longer than"):
                hung.segmentation(asked)


def test_a_process_that_dies_is_told_as_such(
    learned: tuple[Model, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "m.hmcs").write_bytes(learned[1].read_bytes())
    monkeypatch.setattr(segmenting, "_COMMAND", ("false",))
    with pytest.raises(RequestRefusedError, match="ended with 1"):
        by(tmp_path).segmentation(question(learned[0], take(tmp_path)))


def test_of_two_at_once_the_second_is_refused(
    learned: tuple[Model, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "m.hmcs").write_bytes(learned[1].read_bytes())
    monkeypatch.setattr(segmenting, "_COMMAND", ("sleep", "60"))
    asked, one = question(learned[0], take(tmp_path)), by(tmp_path, longest_s=60.0)
    with ThreadPoolExecutor(1) as aside:
        first = aside.submit(one.segmentation, asked)
        while one._process is None:
            assert not first.done()
        with pytest.raises(RequestRefusedError, match="another recording is being segmented"):
            one.segmentation(asked)
        one.close()
        with pytest.raises(RequestRefusedError, match="ended with -9"):
            first.result(30.0)


def test_a_broken_file_is_not_the_model(learned: tuple[Model, Path], tmp_path: Path) -> None:
    (tmp_path / "a.hmcs").write_bytes(b"broken")
    (tmp_path / "b.hmcs").write_bytes(learned[1].read_bytes())
    assert file_with_hash(learned[0].hash, "a", (tmp_path,)) == tmp_path / "b.hmcs"
