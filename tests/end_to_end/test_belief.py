"""The belief over the bus is the belief in process: nothing is added or lost on the way."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import Belief
from hmcs.motion.steps import Step
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import Recognition
from hmcs.recognition.segment_filter.recognizer import SegmentFilterRecognizer
from support.hand import Scene, reported

PATIENT = ("--deadline-ms", "1000")
"""Where equality is promised, not speed: a busy machine must not degrade a belief."""


def assert_same(
    beliefs: list[Belief], model: Model, expected: list[Recognition], to: float
) -> None:
    """Compare beliefs over the bus with those in process, step by step."""
    assert [belief.step for belief in beliefs] == [r.belief.step for r in expected]
    for over, recognition in zip(beliefs, expected, strict=True):
        within = recognition.belief
        assert over.missing_gestemes == ()
        assert over.model_hash == model.hash
        assert over.states == model.state_names
        assert over.segment_start == within.segment_start
        assert over.likely_gesteme == model.gesteme_names[within.gesteme]
        assert over.unknown_alarm == recognition.unknown_alarm
        in_process: dict[str, Any] = {
            "probabilities": within.states,
            "unknown": within.unknown,
            "log_likelihood": within.log_likelihood,
            "mean_log_likelihood": recognition.mean_log_likelihood,
        }
        for what, value in reported(over).items():
            np.testing.assert_allclose(value, in_process[what], rtol=0, atol=to, err_msg=what)


@pytest.mark.parametrize(("precision", "to"), [("float32", 1e-6), ("float64", 1e-12)])
def test_belief_is_the_same_over_the_bus_as_in_process(
    scene: Scene, model_file: Path, model: Model, steps: list[Step], precision: str, to: float
) -> None:
    flags = ("--model", model_file, "--precision", precision)
    stack, recognizer = scene.stack, SegmentFilterRecognizer(model)
    stack.until_ready(
        stack.start("gesteme_classifier", "a", *flags),
        stack.start("gesteme_classifier", "b", *flags),
        stack.start("task_hmm", "t", "--model", model_file, *PATIENT),
    )
    scene.in_step(steps[:300])
    beliefs = [received.body for received in scene.watcher.beliefs]
    assert_same(beliefs, model, [recognizer.step(step) for step in steps[:300]], to)


def test_belief_stays_the_same_when_classifiers_are_swapped(
    scene: Scene, model_file: Path, model: Model, steps: list[Step]
) -> None:
    stack, recognizer = scene.stack, SegmentFilterRecognizer(model)
    old = [stack.start("gesteme_classifier", name, "--model", model_file) for name in "ab"]
    stack.until_ready(*old, stack.start("task_hmm", "t", "--model", model_file, *PATIENT))
    scene.in_step(steps[:100])
    for k, leaving in enumerate(old):
        stack.bring_up("gesteme_classifier", f"new-{k}", "--model", model_file)
        scene.in_step(steps[100 + 50 * k : 125 + 50 * k])
        assert leaving.stop() == 0
        stack.until_gone(leaving)
        scene.in_step(steps[125 + 50 * k : 150 + 50 * k])
    scene.in_step(steps[200:250])
    beliefs = [received.body for received in scene.watcher.beliefs]
    assert_same(beliefs, model, [recognizer.step(step) for step in steps[:250]], 1e-6)
    senders = {r.envelope.source.instance for r in scene.watcher.evidence if r.body.step >= 200}
    assert senders == {"new-0", "new-1"}


@pytest.mark.parametrize("made", [60, 400], ids=["from the beginning", "from within"])
def test_a_task_hmm_that_comes_back_catches_up(
    scene: Scene, model_file: Path, model: Model, steps: list[Step], made: int
) -> None:
    stack, window = scene.stack, model.knowledge.scoring.window_steps
    assert 60 < window < 400
    stack.bring_up("gesteme_classifier", "a", "--model", model_file)
    first = stack.bring_up("task_hmm", "t", "--model", model_file, *PATIENT)
    scene.in_step(steps[: made - 10])
    first.kill()
    stack.until_gone(first)
    for step in steps[made - 10 : made]:
        scene.hand.step(step)
    stack.bring_up("task_hmm", "t", "--model", model_file, *PATIENT)
    scene.in_step(steps[made : made + 50])

    # What it can fetch is a window of steps; where that is all there was, nothing is forgotten.
    remembered = steps[max(0, made - window) : made]
    recognizer = SegmentFilterRecognizer(model, anywhere=made > window)
    for step in remembered:
        recognizer.step(step)
    expected = [recognizer.step(step) for step in steps[made : made + 50]]
    assert_same([r.body for r in scene.watcher.beliefs[-50:]], model, expected, 1e-6)
