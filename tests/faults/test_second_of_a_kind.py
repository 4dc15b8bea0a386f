"""Two of what there must be one of: the first goes on, the second is refused and counted."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np

from hmcs.motion.demonstrations import read_csv
from hmcs.motion.steps import Step
from support.hand import Hand, Scene
from support.stack import PATIENT_FIXTURE

REST = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def test_a_second_input_device_is_refused_while_the_first_is_alive(
    scene: Scene, model_file: Path, steps: list[Step]
) -> None:
    stack, watcher = scene.stack, scene.watcher
    services = [
        stack.start("gesteme_classifier", "a", "--model", model_file),
        stack.start("task_hmm", "t", "--model", model_file, "--deadline-ms", 250),
        stack.start("fixture_controller", "f"),
    ]
    stack.until_ready(*services)
    second = Hand(stack.open_bus("input_device", "second"))

    def sample() -> None:
        scene.hand.sample(*REST, dead_man=False)
        if any(r.envelope.origin for r in watcher.commands):
            second.sample((1.0, 1.0, 1.0), (1.0, 0.0, 0.0))

    scene.bus.every(0.01, sample)
    stack.until(lambda: any(r.envelope.origin for r in watcher.commands))
    scene.hand.play(steps[:60], 100.0)
    second.play(steps[200:230], 50.0)
    stack.until(lambda: watcher.belief_of(59) and len(second.kept) == 30)

    assert {r.body.clock for r in watcher.beliefs} == {scene.hand.clock}
    assert [r.body.step for r in watcher.beliefs] == list(range(60))
    classifier, task, fixture = map(stack.health, services)
    assert classifier.refused == task.refused == {"step": 30}
    assert fixture.refused["step"] == 30
    assert fixture.refused["motion"] > 30
    assert not any(r.body.engaged or r.body.twist.any() for r in watcher.commands)


def test_another_input_device_is_heard_once_the_first_is_gone(
    scene: Scene, model_file: Path, steps: list[Step]
) -> None:
    stack, watcher = scene.stack, scene.watcher
    stack.until_ready(
        stack.start("gesteme_classifier", "a", "--model", model_file),
        stack.start("task_hmm", "t", "--model", model_file, "--deadline-ms", 250),
    )
    scene.in_step(steps[:20])
    stack.elapse(1.1)
    second = Hand(stack.open_bus("input_device", "second"))
    second.play(steps[:40], 100.0)
    stack.until(
        lambda: any(r.body.clock == second.clock and r.body.step == 39 for r in watcher.beliefs)
    )
    heard = [r.body for r in watcher.beliefs if r.body.clock == second.clock]
    assert [belief.step for belief in heard] == list(range(40))
    assert not any(belief.missing_gestemes for belief in heard)


def test_a_second_fixture_controller_moves_nothing_until_the_first_is_gone(
    scene: Scene, performance_file: Path
) -> None:
    stack, watcher = scene.stack, scene.watcher
    robot = stack.bring_up("robot", "r")
    first = stack.bring_up("fixture_controller", "first", *PATIENT_FIXTURE)
    scene.drive(read_csv(performance_file))
    stack.until(lambda: watcher.robot and watcher.robot[-1].body.stop == "none")
    second = stack.start("fixture_controller", "second", *PATIENT_FIXTURE)
    stack.until_ready(second)
    stack.until(lambda: stack.health(robot).refused.get("command", 0) > 20)
    # The robot has never been handed over; a machine that stalls may have stopped it.
    assert "second_writer" not in {r.body.stop for r in watcher.robot}
    assert stack.health(robot).healthy

    first.send(signal.SIGKILL)
    stack.until(lambda: watcher.robot[-1].body.stop != "none")
    stopped = len(watcher.robot)
    stack.until(lambda: len(watcher.robot) > stopped + 200)
    # The second one's commands count now, but it has not been re-engaged since.
    standing = [r.body for r in watcher.robot[stopped + 100 :]]
    assert not any(state.stop == "none" for state in standing)
    assert not any(np.any(state.reference_twist) for state in standing)
