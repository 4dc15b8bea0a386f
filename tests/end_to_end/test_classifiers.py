"""Classifiers come late, hang and die; the belief goes on."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import psutil

from hmcs.bus.messages import Belief, Evidence
from hmcs.motion.steps import Step
from hmcs.recognition.model import Model
from hmcs.recognition.segment_filter.recognizer import SegmentFilterRecognizer
from hmcs_local.processes import StackProcess
from support.hand import Scene

RATE_HZ = 100.0
DEADLINE_S = 0.25
PATIENT = ("--deadline-ms", 1e3 * DEADLINE_S)
"""Who sends which evidence is tested here, not how fast a busy machine lets it through."""


def in_process(model: Model, steps: list[Step]) -> list[np.ndarray]:
    recognizer = SegmentFilterRecognizer(model)
    return [recognizer.step(step).belief.states for step in steps]


def assert_every_step_is_believed(beliefs: list[Belief], model: Model, steps: list[Step]) -> None:
    """No step is left out, none lacks a gesteme, and each belief is as it is in process."""
    assert [belief.step for belief in beliefs] == [step.index for step in steps]
    assert [b.step for b in beliefs if b.missing_gestemes] == []
    for belief, expected in zip(beliefs, in_process(model, steps), strict=True):
        np.testing.assert_allclose(belief.probabilities, expected, rtol=0, atol=1e-6)


def assert_bit_equal(one: Evidence, other: Evidence) -> None:
    assert one.gestemes == other.gestemes
    for field in ("pair_gesteme", "pair_start", "exit", "log_ratio"):
        assert getattr(one, field).tobytes() == getattr(other, field).tobytes(), field


def is_linked(process: StackProcess) -> bool:
    """Whether a process has reached the router: it is up, all that Python imports is behind it."""
    return any(
        connection.status == psutil.CONN_ESTABLISHED
        for connection in psutil.Process(process.pid).net_connections("tcp")
    )


def bring_up(scene: Scene, model_file: Path, *flags: object) -> tuple[StackProcess, StackProcess]:
    """Bring up two classifiers, a and b, and a task HMM."""
    one, other = (
        scene.stack.start("gesteme_classifier", name, "--model", model_file, *flags)
        for name in "ab"
    )
    task = scene.stack.start("task_hmm", "t", "--model", model_file, *PATIENT)
    scene.stack.until_ready(one, other, task)
    return one, other


def test_a_late_joiner_is_ready_at_once_and_then_bit_equal(
    scene: Scene, model_file: Path, steps: list[Step]
) -> None:
    stack, watcher, hand = scene.stack, scene.watcher, scene.hand
    flags = ("--model", model_file, "--redundancy", 3)
    first = [stack.start("gesteme_classifier", name, *flags) for name in "ab"]
    stack.until_ready(*first, stack.start("task_hmm", "t", "--model", model_file, *PATIENT))
    scene.play(steps[:200], RATE_HZ)
    late = stack.start("gesteme_classifier", "late", *flags)
    stack.until(lambda: is_linked(late))
    hand.play(steps[200:500], RATE_HZ / 2)
    stack.until_ready(late)
    stack.until(lambda: watcher.belief_of(499))
    stack.until(lambda: all(499 in watcher.evidence_from(n) for n in ("a", "b", "late")))

    ours, theirs = watcher.evidence_from("late"), watcher.evidence_from("a")
    joined = min(ours)
    assert 200 <= joined < 400, "it joined in the middle of the motion"
    assert sorted(ours) == list(range(joined, 500)), "and has missed no step since"
    for step, evidence in ours.items():
        assert_bit_equal(evidence, theirs[step])
        assert_bit_equal(evidence, watcher.evidence_from("b")[step])


def test_no_step_is_missed_when_one_of_two_classifiers_is_killed(
    scene: Scene, model_file: Path, model: Model, steps: list[Step]
) -> None:
    one, _ = bring_up(scene, model_file)
    scene.play(steps[:100], RATE_HZ)
    scene.hand.play(steps[100:250], RATE_HZ)
    scene.stack.until(lambda: scene.watcher.belief_of(150))
    one.kill()
    scene.stack.until(lambda: scene.watcher.belief_of(249))
    beliefs = [received.body for received in scene.watcher.beliefs]
    assert_every_step_is_believed(beliefs, model, steps[:250])


def test_a_hung_classifier_costs_no_step_and_its_late_evidence_is_counted_never_applied(
    scene: Scene, model_file: Path, model: Model, steps: list[Step]
) -> None:
    one, other = bring_up(scene, model_file)
    task = scene.stack.processes[-1]
    scene.play(steps[:50], RATE_HZ)
    one.send(signal.SIGSTOP)
    scene.play(steps[50:100], RATE_HZ)
    assert scene.stack.health(task).late == {}
    scene.stack.elapse(DEADLINE_S)
    one.send(signal.SIGCONT)
    scene.stack.until(lambda: 99 in scene.watcher.evidence_from("a"))
    scene.play(steps[100:200], RATE_HZ)

    beliefs = [received.body for received in scene.watcher.beliefs]
    assert_every_step_is_believed(beliefs, model, steps[:200])
    hung = [scene.watcher.evidence_from("a")[t] for t in range(50, 100)]
    assert scene.stack.health(task).late == {"evidence": 50}
    for evidence in hung:
        assert_bit_equal(evidence, scene.watcher.evidence_from("b")[evidence.step])
    assert scene.stack.health(other).healthy


def test_a_classifier_that_hung_past_its_lease_catches_up_and_is_bit_equal_again(
    scene: Scene, model_file: Path, model: Model, steps: list[Step]
) -> None:
    one, _ = bring_up(scene, model_file)
    scene.play(steps[:50], RATE_HZ)
    one.send(signal.SIGSTOP)
    scene.stack.until_gone(one)
    scene.play(steps[50:100], RATE_HZ)
    one.send(signal.SIGCONT)
    scene.stack.until_ready(one)
    scene.play(steps[100:200], RATE_HZ)
    scene.stack.until(lambda: all(199 in scene.watcher.evidence_from(name) for name in "ab"))
    beliefs = [received.body for received in scene.watcher.beliefs]
    assert_every_step_is_believed(beliefs, model, steps[:200])
    for t in range(100, 200):
        assert_bit_equal(scene.watcher.evidence_from("a")[t], scene.watcher.evidence_from("b")[t])


def test_with_redundancy_one_a_kill_degrades_at_most_five_steps(
    scene: Scene, model_file: Path, model: Model, steps: list[Step]
) -> None:
    bring_up(scene, model_file, "--redundancy", 1)
    scene.play(steps[:100], RATE_HZ)
    held = {name: set(scene.watcher.evidence_from(name)[99].gestemes) for name in "ab"}
    assert held["a"] | held["b"] == set(model.gesteme_names)
    assert not held["a"] & held["b"]
    victim = max("ab", key=lambda name: len(held[name]))
    scene.hand.play(steps[100:300], RATE_HZ)
    scene.stack.until(lambda: scene.watcher.belief_of(150))
    next(p for p in scene.stack.processes if p.instance == victim).kill()
    scene.stack.until(lambda: scene.watcher.belief_of(299))

    beliefs = [received.body for received in scene.watcher.beliefs]
    assert [belief.step for belief in beliefs] == list(range(300))
    degraded = {b.step: set(b.missing_gestemes) for b in beliefs if b.missing_gestemes}
    assert len(degraded) <= 5
    assert all(missing <= held[victim] for missing in degraded.values()), degraded
    survivor = ({"a", "b"} - {victim}).pop()
    assert set(scene.watcher.evidence_from(survivor)[299].gestemes) == set(model.gesteme_names)


def test_a_step_without_evidence_is_believed_after_the_deadline_and_names_what_was_missing(
    scene: Scene, model_file: Path, steps: list[Step]
) -> None:
    flags = ("--model", model_file, "--gestemes", '["GShape", "Snake"]')
    scene.stack.bring_up("gesteme_classifier", "a", *flags)
    scene.stack.bring_up("task_hmm", "t", "--model", model_file, *PATIENT)
    scene.play(steps[:30], RATE_HZ)
    for received in scene.watcher.beliefs:
        assert received.body.missing_gestemes == ("NShape", "PShape", "JShape")
        assert np.isclose(received.body.probabilities.sum() + received.body.unknown, 1.0)
