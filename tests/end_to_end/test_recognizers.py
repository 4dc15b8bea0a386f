"""Recognizers side by side: one is followed, the others are shadows until they are activated."""

from __future__ import annotations

from pathlib import Path

import pytest

from hmcs.bus.messages import ActivateRecognizer, Done
from hmcs.bus.session import RequestRefusedError
from hmcs.motion.demonstrations import read_csv
from support.hand import Scene


def test_a_shadow_is_activated_without_a_gap(
    scene: Scene, model_file: Path, shadow_model_file: Path, performance_file: Path
) -> None:
    stack, watcher = scene.stack, scene.watcher
    fixture = stack.start(
        "fixture_controller",
        "f",
        *("--models", f'["{model_file}", "{shadow_model_file}"]', "--active-model", "human-shapes"),
        # The hand is of this thread, which asks and waits.
        *("--input-stale-after-ms", 500),
    )
    patient = ("--deadline-ms", 80)
    stack.until_ready(
        fixture,
        stack.start("gesteme_classifier", "a", "--model", model_file),
        stack.start("gesteme_classifier", "s", "--model", shadow_model_file),
        stack.start("task_hmm", "t", "--model", model_file, *patient),
        stack.start("task_hmm", "shadow", "--model", shadow_model_file, *patient),
    )
    scene.drive(read_csv(performance_file))
    stack.until(lambda: watcher.fixture and watcher.fixture[-1].body.factor > 0.75)
    before = len(watcher.fixture)
    assert {r.body.model for r in watcher.fixture if r.body.state} == {"human-shapes"}
    believed = {r.key for r in watcher.beliefs}
    keys = scene.bus.keys
    assert believed == {keys.belief("human-shapes", "t"), keys.belief("shadow", "shadow")}

    key = scene.bus.keys.rpc("fixture_controller", "f", "activate")
    (answer,) = scene.bus.ask(key, ActivateRecognizer(model="shadow"), Done)
    assert answer.body.detail.startswith("follows shadow ")
    stack.until(lambda: watcher.fixture[-1].body.model == "shadow")
    switched = len(watcher.fixture)
    stack.until(lambda: len(watcher.fixture) > switched + 50)

    around = [r.body for r in watcher.fixture[before - 1 :]]
    assert {state.reason for state in around} == {"guiding"}
    assert min(state.factor for state in around) > 0.7
    assert [s.model for s in around] == sorted(s.model for s in around), "it switches once"
    caused = [r.envelope.origin.seq for r in watcher.fixture[before - 1 :] if r.envelope.origin]
    assert caused == list(range(caused[0], caused[0] + len(around))), "one for every sample"


def test_a_recognizer_that_is_not_loaded_is_refused_and_nothing_changes(
    scene: Scene, model_file: Path
) -> None:
    fixture = scene.stack.bring_up(
        "fixture_controller",
        "f",
        *("--models", f'["{model_file}"]', "--active-model", "human-shapes"),
    )
    key = scene.bus.keys.rpc("fixture_controller", "f", "activate")
    with pytest.raises(RequestRefusedError, match="'nobody' is not loaded; loaded: human-shapes"):
        scene.bus.ask(key, ActivateRecognizer(model="nobody"), Done)
    assert "follows human-shapes" in scene.stack.health(fixture).detail
