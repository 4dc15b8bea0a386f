"""The router goes and comes back: everything goes on by itself."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from hmcs.motion.steps import Step
from hmcs.recognition.model import Model
from support.hand import Scene
from support.stack import DEADLINE_S, PATIENT_ROBOT, log_events

RATE_HZ = 50.0


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_everything_goes_on_when_the_router_comes_back(
    scene: Scene, model_file: Path, model: Model, steps: list[Step], how: signal.Signals
) -> None:
    stack, watcher, hand = scene.stack, scene.watcher, scene.hand
    services = [
        stack.start("gesteme_classifier", "a", "--model", model_file),
        stack.start("gesteme_classifier", "b", "--model", model_file),
        stack.start("task_hmm", "t", "--model", model_file, "--deadline-ms", 250),
        stack.start("fixture_controller", "f", "--models", f'["{model_file}"]'),
        stack.start("robot", "r", *PATIENT_ROBOT),
    ]
    stack.until_ready(*services)
    pids = [service.pid for service in services]
    hand.play(steps[:400], RATE_HZ)
    scene.bus.every(0.01, lambda: hand.sample(steps[0].position, (0.0, 0.0, 0.0), dead_man=False))
    stack.until(lambda: watcher.belief_of(50) and watcher.robot and watcher.fixture)

    stack.router.send(how)
    stack.router.wait(DEADLINE_S)
    stack.until(lambda: not scene.bus.connected)
    stack.elapse(0.5)
    outage_from = watcher.beliefs[-1].body.step
    seen = len(watcher.robot), len(watcher.fixture)
    stack.start_router()
    stack.until(lambda: watcher.beliefs[-1].body.step > outage_from)
    stack.until(lambda: len(watcher.robot) > seen[0] and len(watcher.fixture) > seen[1])
    stack.until(lambda: watcher.belief_of(399))
    stack.until_ready(*services)

    assert [service.pid for service in services] == pids
    assert all(service.running for service in services)
    for service in services:
        assert stack.health(service).healthy, service.service
        events = [event["event"] for event in log_events(service)]
        assert "connection lost: going on by itself" in events, service.service
        assert "connected again" in events, service.service
    # Both levels fetched what they had missed: no step is without a belief in the end.
    resumed = [r.body for r in watcher.beliefs if r.body.step > outage_from]
    assert [belief.step for belief in resumed][-100:] == list(range(300, 400))
    assert not any(belief.missing_gestemes for belief in resumed[-100:])
    assert {belief.model_hash for belief in resumed} == {model.hash}
