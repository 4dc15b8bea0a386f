"""A recognizer on the bus, in the thread of the test: what it says, and what it says of itself."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from pydantic import ValidationError

from hmcs.bus.keys import recognizer_in
from hmcs.bus.messages import LoadModel, Step
from hmcs.bus.service import Service
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import ModelFileError, save_model
from hmcs.recognition.registry import recognizer_of
from hmcs_recognizer.service import RecognizerService
from hmcs_recognizer.settings import RecognizerSettings
from support.hand import Scene
from support.lessons import lesson_task, performed, steps_performed
from support.stack import Stack

LOG = logging.getLogger("test")


class Taught(NamedTuple):
    model: Model
    path: Path


class Bench(NamedTuple):
    """A recognizer and a hand, both in this thread."""

    scene: Scene
    service: Service

    def until_believed(self, count: int) -> None:
        self.scene.until_beliefs(count, within_s=10.0)


@pytest.fixture(scope="module")
def taught(tmp_path_factory: pytest.TempPathFactory) -> Taught:
    path = tmp_path_factory.mktemp("model") / "data.hmcs"
    model = learn(lesson_task(), [performed(1), performed(2)], recognizer="task-hmm")
    return Taught(save_model(model, path), path)


@pytest.fixture
def bench(tmp_path: Path, taught: Taught) -> Iterator[Bench]:
    with Stack(tmp_path) as stack:
        bus = stack.open_bus("recognizer", "here")
        service = RecognizerService(RecognizerSettings(model=taught.path), bus, LOG)
        # Nobody could answer for the last steps: the hand of this thread comes up after it.
        service.start()
        yield Bench(Scene(stack), service)


def test_a_belief_for_every_step_is_what_the_model_says_in_process(
    bench: Bench, taught: Taught
) -> None:
    steps = steps_performed(3)[:40]
    for step in steps:
        bench.scene.hand.step(step)
    bench.until_believed(len(steps))
    recognizer = recognizer_of(taught.model)
    for received, step in zip(bench.scene.watcher.beliefs, steps, strict=True):
        expected = recognizer.step(step).belief
        assert received.body.step == step.index
        assert received.body.model_hash == taught.model.hash
        np.testing.assert_array_equal(received.body.probabilities, expected.states)


def test_a_step_that_comes_again_is_refused_and_changes_no_belief(bench: Bench) -> None:
    steps = steps_performed(4)[:10]
    hand = bench.scene.hand
    for step in steps[:5]:
        hand.step(step)
    hand.repeat(2)
    for step in steps[5:]:
        hand.step(step)
    bench.until_believed(len(steps))
    assert [r.body.step for r in bench.scene.watcher.beliefs] == [step.index for step in steps]
    assert bench.service.bus.counters.refused[Step.SCHEMA] == 1


def test_it_says_what_it_runs_and_how_far_it_is(bench: Bench, taught: Taught) -> None:
    facts = bench.service.facts()
    assert facts["model"] == taught.model.name
    assert facts["model_hash"] == taught.model.hash
    assert facts["recognizer"] == "task-hmm"
    assert "Hannaford" in facts["source"]
    for step in steps_performed(5)[:3]:
        bench.scene.hand.step(step)
    bench.until_believed(3)
    assert bench.service.health() == (True, f"{taught.model.name}: task-hmm, 3 beliefs")


def test_a_file_that_is_no_model_is_reported(tmp_path: Path, bench: Bench) -> None:
    file = tmp_path / "no-model.hmcs"
    file.write_text("not a model", encoding="utf-8")
    with pytest.raises(ModelFileError, match=r"no-model\.hmcs"):
        RecognizerService(RecognizerSettings(model=file), bench.service.bus, LOG)


@pytest.mark.parametrize("memory_steps", [0, -1, 10_001])
def test_a_memory_out_of_range_is_refused(memory_steps: int) -> None:
    with pytest.raises(ValidationError, match="memory_steps"):
        RecognizerSettings(model=Path("any.hmcs"), memory_steps=memory_steps)


def test_it_takes_another_model_while_it_runs(bench: Bench, taught: Taught, tmp_path: Path) -> None:
    another = tmp_path / "another.hmcs"
    save_model(taught.model._replace(name="another"), another)
    steps = steps_performed(6)[:30]
    for step in steps[:10]:
        bench.scene.hand.step(step)
    bench.until_believed(10)
    scene = bench.scene
    with ThreadPoolExecutor(1) as aside:
        loading = aside.submit(bench.service._load, LoadModel(path=str(another)))
        while not loading.done():
            scene.stack.pump()
    assert loading.result().detail.startswith("another ")
    for step in steps[10:]:
        scene.hand.step(step)
    bench.until_believed(10 + 2 * 20)
    by_name: dict[str, list[int]] = {taught.model.name: [], "another": []}
    for received in scene.watcher.beliefs:
        by_name[recognizer_in(received.key).model].append(received.body.step)
    assert by_name[taught.model.name] == [step.index for step in steps]
    assert by_name["another"] == [step.index for step in steps[10:]]
    reported = [r.body for r in scene.watcher.beliefs if r.body.step == steps[-1].index]
    np.testing.assert_array_equal(reported[0].probabilities, reported[1].probabilities)


def test_of_a_layered_model_it_tells_the_evidence_its_beliefs_stand_on(
    bench: Bench, tmp_path: Path
) -> None:
    layered = learn(lesson_task(), [performed(1), performed(2)])
    file = tmp_path / "layered.hmcs"
    model = save_model(layered._replace(name="layered"), file)
    scene = bench.scene
    with ThreadPoolExecutor(1) as aside:
        loading = aside.submit(bench.service._load, LoadModel(path=str(file)))
        while not loading.done():
            scene.stack.pump()
    steps = steps_performed(6)[:30]
    for step in steps:
        scene.hand.step(step)
    bench.until_believed(2 * len(steps))
    scene.stack.until(lambda: len(scene.watcher.evidence) >= len(steps))
    assert {recognizer_in(r.key).model for r in scene.watcher.evidence} == {"layered"}
    recognizer = recognizer_of(model)
    for received, step in zip(scene.watcher.evidence, steps, strict=True):
        expected = recognizer.step(step).evidence
        assert expected is not None
        assert received.body.step == step.index
        np.testing.assert_array_equal(received.body.pair_start, expected.pair_start)
        np.testing.assert_array_equal(received.body.exit, expected.exit)
        np.testing.assert_array_equal(received.body.log_ratio, expected.log_ratio)


def test_without_a_model_it_waits_to_be_given_one() -> None:
    assert RecognizerSettings(model="").model is None
    assert RecognizerSettings().model is None


@pytest.mark.parametrize(
    ("kind", "hosted"), [("task-hmm", ["lesson"]), ("segment-filter", []), (None, [])]
)
def test_of_a_folder_it_begins_with_the_tasks_model_unless_layered_processes_run_it(
    tmp_path: Path, kind: str | None, hosted: list[str]
) -> None:
    if kind is not None:
        model = learn(lesson_task(), [performed(1), performed(2)], recognizer=kind)
        save_model(model, tmp_path / "human-shapes.hmcs")
    with Stack(tmp_path / "stack") as stack:
        settings = RecognizerSettings(model=tmp_path, task="human-shapes")
        service = RecognizerService(settings, stack.open_bus("recognizer", "here"), LOG)
        assert service.facts()["model"].split() == hosted
