"""A stale command stops the robot, and only a deliberate re-engage sets it in motion again."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.messages import Ask, RobotState
from hmcs.bus.session import Received
from hmcs.bus.verbs import PLAY, STOP
from support.stack import DEADLINE_S, Stack
from support.stops import KINDS, FastLoop, How, Victim

TRIALS = 3
SEEN_LATE = 2.0
"""Times the time there is, on a machine with other work; `make bench` admits none."""


@pytest.fixture(scope="module")
def fast_loop(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FastLoop]:
    folder: Path = tmp_path_factory.mktemp("fast-loop")
    with Stack(folder) as stack:
        yield FastLoop(stack, folder, np.random.default_rng(7))


@pytest.mark.parametrize(("victim", "how"), KINDS)
def test_the_robot_stands_in_time_and_moves_again_only_when_re_engaged(
    fast_loop: FastLoop, victim: Victim, how: How
) -> None:
    for _ in range(TRIALS):
        trial = fast_loop.trial(victim, how)
        assert trial.good_within(SEEN_LATE), trial


def test_a_robot_that_hung_stands_until_re_engaged(fast_loop: FastLoop) -> None:
    fast_loop.until_moving()
    stack, watcher, robot = fast_loop.stack, fast_loop.watcher, fast_loop.robot
    robot.send(signal.SIGSTOP)
    stack.elapse(0.2)
    watcher.robot.clear()
    watcher.motions.clear()
    robot.send(signal.SIGCONT)
    stack.until(lambda: any(r.body.stop == "stale_command" for r in watcher.robot))
    stopped = next(i for i, r in enumerate(watcher.robot) if r.body.stop == "stale_command")
    stack.until(lambda: any(_moves(r) for r in watcher.robot[stopped:]))

    assert stopped <= 3, "only what was under way when it hung may still be sent"
    moved_ns = next(r.received_ns for r in watcher.robot[stopped:] if _moves(r))
    assert any(r.received_ns < moved_ns and not r.body.dead_man for r in watcher.motions)
    assert stack.health(robot).healthy


def test_a_stop_that_was_asked_for_holds_until_the_played_operator_is_asked_to_play(
    fast_loop: FastLoop,
) -> None:
    """Also one in the rest between two passes, when nobody drives the robot."""
    stack, watcher = fast_loop.stack, fast_loop.watcher
    asker = stack.open_bus("asker", "a")
    for at_rest in (False, True):
        fast_loop.until_moving()
        if at_rest:
            stack.until(lambda: not watcher.motions[-1].body.dead_man)
        STOP.ask(asker, Ask(), timeout_s=DEADLINE_S)
        stack.until(lambda: not watcher.motions[-1].body.dead_man)
        stack.elapse(0.3)
        watcher.robot.clear()
        # Longer than a pass and its rest, after which a recording would press again.
        stack.elapse(2.0)
        assert not any(_moves(state) for state in watcher.robot)
        health = stack.health(fast_loop.input)
        assert health.healthy
        assert health.detail.startswith("stopped: robot was asked to stand")
        (answer,) = PLAY.ask(asker, Ask(), timeout_s=DEADLINE_S)
        assert "goes on at" in answer.body.detail
        stack.until(lambda: watcher.robot and _moves(watcher.robot[-1]))


def _moves(state: Received[RobotState]) -> bool:
    return bool(np.any(state.body.reference_twist))
