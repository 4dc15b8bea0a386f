"""Faults of the slow loop: steps out of order, another model's evidence, beliefs that stay out."""

from __future__ import annotations

import json
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from hmcs.fixtures.compliance.factor import FREE_FACTOR
from hmcs.motion.demonstrations import read_csv
from hmcs.motion.steps import Step
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model
from hmcs.recognition.segment_filter.recognizer import SegmentFilterRecognizer
from support.hand import Scene

PATIENT = ("--deadline-ms", 250)
FREE_WITHIN_S = 0.2


def test_steps_that_repeat_or_jump_back_are_refused_and_change_no_belief(
    scene: Scene, model_file: Path, model: Model, steps: list[Step]
) -> None:
    stack, hand, watcher = scene.stack, scene.hand, scene.watcher
    listeners = [
        stack.start("gesteme_classifier", "a", "--model", model_file),
        stack.start("task_hmm", "t", "--model", model_file, *PATIENT),
        stack.start("fixture_controller", "f", "--models", json.dumps([str(model_file)])),
    ]
    stack.until_ready(*listeners)
    scene.in_step(steps[:40])
    for index in (39, 39, 20, 0):
        hand.repeat(index)
    scene.in_step(steps[40:80])

    for service in listeners:
        assert stack.health(service).refused == {"step": 4}, service.service
        assert stack.health(service).healthy
    recognizer = SegmentFilterRecognizer(model)
    assert [r.body.step for r in watcher.beliefs] == list(range(80))
    for received, step in zip(watcher.beliefs, steps, strict=False):
        expected = recognizer.step(step).belief.states
        np.testing.assert_allclose(received.body.probabilities, expected, rtol=0, atol=1e-6)


def test_a_step_that_jumps_ahead_is_believed_once_those_before_it_are_fetched(
    scene: Scene, model_file: Path, model: Model, steps: list[Step]
) -> None:
    scene.stack.until_ready(
        scene.stack.start("gesteme_classifier", "a", "--model", model_file),
        scene.stack.start("task_hmm", "t", "--model", model_file, *PATIENT),
    )
    scene.in_step(steps[:40])
    for step in steps[40:45]:
        scene.hand.keep(step)
    scene.hand.step(steps[45])
    scene.stack.until(lambda: scene.watcher.belief_of(45))

    assert [r.body.step for r in scene.watcher.beliefs] == list(range(46))
    recognizer = SegmentFilterRecognizer(model)
    for received, step in zip(scene.watcher.beliefs, steps, strict=False):
        expected = recognizer.step(step).belief.states
        np.testing.assert_allclose(received.body.probabilities, expected, rtol=0, atol=1e-6)
        assert received.body.missing_gestemes == ()


def test_a_classifier_of_another_model_is_refused_and_what_is_missing_is_named(
    scene: Scene, model_file: Path, other_model_file: Path, model: Model, steps: list[Step]
) -> None:
    assert load_model(other_model_file).name == model.name
    scene.stack.bring_up("gesteme_classifier", "a", "--model", other_model_file)
    task = scene.stack.bring_up("task_hmm", "t", "--model", model_file, "--deadline-ms", 30)
    scene.in_step(steps[:10])
    beliefs = [received.body for received in scene.watcher.beliefs]
    assert [belief.step for belief in beliefs] == list(range(10))
    assert {belief.missing_gestemes for belief in beliefs} == {model.gesteme_names}
    scene.stack.until(lambda: scene.stack.health(task).refused == {"evidence": 10})
    assert scene.stack.health(task).healthy


def test_a_task_hmm_of_another_model_than_the_fixtures_is_refused(
    scene: Scene, model_file: Path, other_model_file: Path, steps: list[Step]
) -> None:
    models = json.dumps([str(model_file)])
    fixture = scene.stack.bring_up("fixture_controller", "f", "--models", models)
    scene.stack.until_ready(
        scene.stack.start("gesteme_classifier", "a", "--model", other_model_file),
        scene.stack.start("task_hmm", "t", "--model", other_model_file, *PATIENT),
    )
    scene.in_step(steps[:10])
    scene.stack.until(lambda: scene.stack.health(fixture).refused == {"belief": 10})


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_the_fixture_fades_to_free_motion_when_beliefs_stay_out(
    scene: Scene, model_file: Path, performance_file: Path, how: signal.Signals
) -> None:
    stack, watcher = scene.stack, scene.watcher
    task = stack.start("task_hmm", "t", "--model", model_file, *PATIENT)
    stack.until_ready(
        task,
        stack.start("gesteme_classifier", "a", "--model", model_file),
        stack.start(
            "fixture_controller",
            "f",
            *("--models", json.dumps([str(model_file)])),
            # The hand is of this thread; a machine that stalls must not make it let go.
            *("--input-stale-after-ms", 500),
        ),
    )
    scene.drive(read_csv(performance_file))
    stack.until(lambda: watcher.fixture and watcher.fixture[-1].body.factor > 0.75)
    made = len(scene.hand.kept)
    fault_ns = time.monotonic_ns()
    task.send(how)
    stack.until(lambda: watcher.fixture[-1].body.factor == FREE_FACTOR)
    # A belief owes its answer from the first step it leaves out.
    owed_ns = next(o.captured_ns for _, o in scene.hand.kept[made:] if o.captured_ns > fault_ns)
    # By the hand's clock: a machine that stalls makes no samples meanwhile.
    stiff_ns = [
        state.envelope.origin.captured_ns
        for state in list(watcher.fixture)
        if state.body.factor > FREE_FACTOR and state.envelope.origin is not None
    ]
    assert (max(stiff_ns) - owed_ns) * 1e-9 < FREE_WITHIN_S

    free = watcher.fixture[-1].body
    assert (free.reason, free.state, free.engaged) == ("belief_stale", "", True)
    assert not free.preferred_direction.any()
    np.testing.assert_allclose(free.command_twist, free.operator_twist, rtol=0, atol=1e-12)
    if how == signal.SIGSTOP:
        task.send(signal.SIGCONT)
        stack.until(lambda: watcher.fixture[-1].body.factor > 0.75)
        assert watcher.fixture[-1].body.reason == "guiding"
