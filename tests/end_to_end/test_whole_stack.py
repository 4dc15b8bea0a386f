"""The whole stack on human motion: the robot goes where the hand goes, lent a ruler on the way."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from hmcs.recognition.model import Model
from hmcs.recognition.segment_filter.recognizer import SegmentFilterRecognizer
from hmcs.translation import step_of
from support.hand import Watcher
from support.stack import PATIENT_FIXTURE, PATIENT_ROBOT, Stack

SPAN_S = 10.0
"""How much of the performance is watched: two shapes and a switch between them."""

LATE_NS = 40_000_000
"""So long after one sample the robot ought to follow another: there are a hundred a second."""

Perform = Callable[..., Watcher]


@pytest.fixture
def perform(stack: Stack, performance_file: Path) -> Perform:
    """Bring up a whole stack and let the operator perform for a while; returns what was seen."""

    def run(*model_files: Path) -> Watcher:
        bus = stack.open_bus("observer", "o")
        stack.watch(bus)
        watcher = Watcher(bus)
        models = [("--model", file) for file in model_files]
        stack.until_ready(
            stack.start("robot", "r", *PATIENT_ROBOT),
            stack.start(
                "fixture_controller",
                "f",
                *("--models", json.dumps([str(f) for f in model_files])),
                *PATIENT_FIXTURE,
            ),
            *(stack.start("gesteme_classifier", c, *model) for model in models for c in "ab"),
            *(stack.start("task_hmm", "t", *model, "--deadline-ms", 250) for model in models),
        )
        stack.bring_up(
            "input_device",
            "i",
            *("--source", "recorded", "--demonstration", performance_file, "--rate-hz", 100),
            *("--lead-in-s", 0.5, "--wait-for", '["robot", "fixture_controller"]'),
        )
        stack.until(lambda: watcher.motions and watcher.motions[-1].body.dead_man)
        stack.elapse(SPAN_S)
        for process in stack.processes[1:]:
            health = stack.health(process)
            assert health.healthy, health.detail
            assert (health.refused, health.lost) == ({}, {}), process.service
        return watcher

    return run


def ways(watcher: Watcher) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where the hand and the tool went, each from its start, m, both of shape (T, 3).

    A tool position belongs to the sample whose command the robot was following then.
    """
    hand = {r.envelope.seq: r.body.position for r in watcher.motions}
    pairs = [
        (hand[r.envelope.origin.seq], r.body.tool_position)
        for r in watcher.robot
        if r.envelope.origin is not None and r.envelope.origin.seq in hand
    ]
    there, here = (np.array(column) for column in zip(*pairs, strict=True))
    assert np.ptp(there, axis=0).max() > 0.15, "the hand has gone a good way"
    return there - there[0], here - here[0]


def in_time(watcher: Watcher) -> Iterator[slice]:
    """Yield the stretches of `ways` without a pause between the samples that the robot followed.

    A process that waits for a processor misses samples: the hand is farther on then than its
    velocities say, which nobody takes back.
    """
    known = {r.envelope.seq for r in watcher.motions}
    origins = [r.envelope.origin for r in watcher.robot]
    taken_ns = [o.captured_ns for o in origins if o is not None and o.seq in known]
    late = np.flatnonzero(np.diff(taken_ns) > LATE_NS) + 1
    ends = [0, *late.tolist(), len(taken_ns)]
    yield from (slice(begin, end) for begin, end in pairwise(ends) if end - begin > 1)


def test_without_recognition_the_robot_goes_exactly_where_the_hand_goes(perform: Perform) -> None:
    watcher = perform()
    hand, tool = ways(watcher)
    followed_m = 0.0
    for stretch in in_time(watcher):
        there, here = (way[stretch] - way[stretch][0] for way in (hand, tool))
        off_m = np.linalg.norm(here - there, axis=1)
        assert np.sqrt((off_m**2).mean()) < 0.002
        assert off_m[-1] < 0.005
        followed_m += float(np.linalg.norm(np.diff(there, axis=0), axis=1).sum())
    assert followed_m > 0.15
    assert {r.body.reason for r in watcher.fixture if r.body.engaged} == {"no_belief"}


def test_with_recognition_it_is_guided_along_the_way_of_the_hand(
    perform: Perform, model_file: Path, model: Model
) -> None:
    watcher = perform(model_file)
    hand, tool = ways(watcher)
    # Guidance takes from the velocity across the learned path, never turns it around; where the
    # machine is busy the tool lags as well.
    assert np.linalg.norm(tool - hand, axis=1).max() < 0.1
    engaged = [r.body for r in watcher.fixture if r.body.engaged]
    assert np.mean([state.reason == "guiding" for state in engaged]) > 0.9
    assert {"write-g", "write-n"} <= {state.state for state in engaged}
    assert not any(r.body.contacts for r in watcher.robot)

    beliefs = [r.body for r in watcher.beliefs]
    recognizer = SegmentFilterRecognizer(model)
    made = [step_of(received.body) for received in watcher.steps[: len(beliefs)]]
    expected = [recognizer.step(step).belief.states for step in made]
    assert [belief.step for belief in beliefs] == list(range(len(beliefs)))
    agree = [
        belief.likely_state == model.state_names[int(states.argmax())]
        for belief, states in zip(beliefs, expected, strict=True)
    ]
    # On a busy machine a belief may have to do without the evidence of a gesteme.
    assert np.mean(agree) > 0.95


@pytest.mark.parametrize("guided", [False, True])
def test_a_simulated_operator_closes_the_loop_through_the_bus(
    stack: Stack, tmp_path: Path, model_file: Path, model: Model, guided: bool
) -> None:
    task = model.task
    meant = model.paths[task.states[0].gestemes[0]].points + np.array(task.robot.tool_start_m)
    rows = [f"{t},{x},{y},{z},{task.states[0].name}" for t, (x, y, z) in enumerate(meant)]
    file = tmp_path / "meant.csv"
    file.write_text("\n".join(["time_s,x_m,y_m,z_m,state", *rows]))
    bus = stack.open_bus("observer", "o")
    stack.watch(bus)
    watcher = Watcher(bus)
    recognizers = ()
    if guided:
        recognizers = (
            stack.start("gesteme_classifier", "a", "--model", model_file),
            stack.start("task_hmm", "t", "--model", model_file, "--deadline-ms", 250),
        )
    models = json.dumps([str(model_file)] if guided else [])
    stack.until_ready(
        stack.start("robot", "r", *PATIENT_ROBOT),
        stack.start("fixture_controller", "f", "--models", models, *PATIENT_FIXTURE),
        *recognizers,
    )
    stack.bring_up(
        "input_device",
        "i",
        *("--source", "simulated", "--operator", "steady", "--demonstration", file),
        *("--lead-in-s", 0.5, "--wait-for", '["robot", "fixture_controller"]'),
    )

    def arrived() -> bool:
        if not watcher.robot:
            return False
        tool = watcher.robot[-1].body.tool_position
        return float(np.linalg.norm(tool - meant[-1])) < 0.012

    stack.until(arrived)
    tool = np.array([r.body.tool_position for r in watcher.robot])
    off_m = [np.linalg.norm(meant - place, axis=1).min() for place in tool]
    # The operator errs and the robot lags, but what is seen to go wrong is put right.
    assert max(off_m) < 0.03
    reasons = {r.body.reason for r in watcher.fixture if r.body.engaged}
    assert ("guiding" in reasons) == guided
