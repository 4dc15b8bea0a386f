"""A recorded cell again: the very same beliefs, demonstrations to learn from, a live operator."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.messages import Ask, Health, Motion
from hmcs.motion.steps import Step
from hmcs.recordings.comparing import compared
from hmcs.recordings.inspection import inspected
from hmcs.recordings.reading import RecordingContent, read
from hmcs.recordings.replaying import kept_model, replayed
from support.hand import PERIOD_S, Scene


def recorded(scene: Scene, folder: Path) -> RecordingContent:
    """End the recorder and read what it wrote."""
    (process,) = [p for p in scene.stack.processes if p.service == "recorder"]
    assert process.stop() == 0
    (file,) = folder.glob("*.mcap")
    return read(file)


def until_recorded(scene: Scene, schema: str, count: int) -> None:
    """Wait until the recorder has got so many messages."""
    key = scene.bus.keys.rpc("recorder", "rec", "health")

    def received() -> int:
        answers = scene.bus.ask(key, Ask(), Health)
        return answers[0].body.received.get(schema, 0) if answers else 0

    scene.stack.until(lambda: received() >= count)


@pytest.fixture
def recordings(tmp_path: Path) -> Path:
    return tmp_path / "recordings"


@pytest.mark.parametrize("layered", [True, False], ids=["two classifiers", "one process"])
def test_a_replay_with_the_same_model_believes_the_very_same(
    scene: Scene, model_file: Path, steps: list[Step], recordings: Path, layered: bool
) -> None:
    stack = scene.stack
    if layered:
        stack.until_ready(
            *(stack.start("gesteme_classifier", name, "--model", model_file) for name in "ab"),
            stack.start("task_hmm", "t", "--model", model_file, "--deadline-ms", "1000"),
        )
    else:
        stack.bring_up("recognizer", "r", "--model", model_file)
    stack.bring_up(
        "recorder", "rec", "--folder", recordings, "--models", f'["{model_file}"]', "--free-mb", "0"
    )
    scene.in_step(steps[:300])
    until_recorded(scene, "belief", 300)
    until_recorded(scene, "step", 300)
    content = recorded(scene, recordings)
    assert inspected(content).problems == ()
    comparison = compared(replayed(content, kept_model(content)))
    assert comparison.steps == comparison.compared == 300
    assert comparison.same_bits == 300
    assert comparison.agreement == 1.0


def test_a_recorded_device_log_replays_as_the_device(scene: Scene, recordings: Path) -> None:
    stack = scene.stack
    stack.bring_up("recorder", "rec", "--folder", recordings, "--free-mb", "0")
    coming = iter(range(100))

    def move() -> None:
        k = next(coming, None)
        if k is not None:
            scene.hand.sample([0.002 * k, 0, 0], [0.2, 0, 0], dead_man=k >= 20)

    scene.bus.every(PERIOD_S, move)
    stack.until(lambda: scene.watcher.motions and scene.watcher.motions[-1].body.position[0] > 0.19)
    file = recorded(scene, recordings).path
    stack.start(
        "input_device", "replay", "--source", "recording", "--demonstration", file,
        "--task", "human-shapes", "--lead-in-s", "0.2",
    )  # fmt: skip

    def last() -> bool:
        reported = [r.body for r in scene.watcher.motions if r.envelope.source.instance == "replay"]
        return any(m.dead_man and m.position[0] > 0.17 for m in reported)

    stack.until(last)
    held = [
        r.body.position[0]
        for r in scene.watcher.motions
        if r.envelope.source.instance == "replay" and r.body.dead_man
    ]
    original = [m.position[0] for _, _, m in read(file).of(Motion) if m.dead_man]
    assert held[0] >= original[0]
    assert set(np.round(held, 9)) <= set(np.round(original, 9))
