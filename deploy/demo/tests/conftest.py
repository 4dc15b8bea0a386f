"""A small run as the observer would have recorded it, made without a bus."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import steps_of
from hmcs.recognition.learning import learn
from hmcs.recognition.model import Model
from hmcs.recognition.segment_filter.recognizer import SegmentFilterRecognizer
from hmcs.task import load_task
from hmcs_demo.measure import Measured, measure
from hmcs_demo.recording import (
    Beliefs,
    Commands,
    Fixtures,
    Members,
    Motions,
    Recording,
    RobotStates,
    Steps,
    table,
)
from hmcs_demo.summary import RunFacts, Summary, summarize

RATE_HZ = 100.0
MS = 1_000_000
BEGAN_NS = 5_000_000_000
TASK = """
format: hmcs-task/1
name: corner
dead_zone_m: 0.008
gestemes: [{name: right}, {name: up}]
states:
  - {name: go-right, gestemes: [right], next: [go-up]}
  - {name: go-up, gestemes: [up], next: [go-right]}
start: [go-right]
workspace: {lower_m: [-1, -1, -1], upper_m: [1, 1, 1]}
robot: {model: puma560, tool_start_m: [0, 0, 0], tool_orientation_xyzw: [0, 0, 0, 1]}
"""


def stroke(direction: tuple[float, float, float], state: str, bend_m: float = 0.0) -> Demonstration:
    """0.2 m in 2 s, bent aside by so much in its middle."""
    share = np.linspace(0.0, 1.0, 201)
    along = 0.2 * share[:, None] * np.array(direction)
    aside = bend_m * np.sin(np.pi * share)[:, None] * np.array([1.0, 0.0, 0.0])
    return Demonstration(state, 2.0 * share, along + aside, (state,) * 201)


@pytest.fixture(scope="session")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    """Two strokes, taught from three demonstrations each."""
    path = tmp_path_factory.mktemp("task") / "corner.yaml"
    path.write_text(TASK, encoding="utf-8")
    bends = (-0.004, 0.0, 0.004)
    rights = [stroke((0, 1, 0), "go-right", bend) for bend in bends]
    ups = [stroke((0, 0, 1), "go-up", bend) for bend in bends]
    return learn(load_task(path), [*rights, *ups], progress=lambda _: None)


@pytest.fixture(scope="session")
def performance() -> Demonstration:
    """Right, then up, without a pause."""
    first, second = stroke((0, 1, 0), "go-right"), stroke((0, 0, 1), "go-up")
    return Demonstration(
        "performance",
        np.concatenate([first.time_s, second.time_s[1:] + 2.0]),
        np.concatenate([first.positions, second.positions[1:] + first.positions[-1]]),
        (*first.states[:-1], *second.states),
    )


@pytest.fixture
def recorded(model: Model, performance: Demonstration) -> Callable[..., Recording]:
    """Record the performance; `late_ns` shifts each sample, `without` drops beliefs of steps."""

    def record(late_ns: int = 0, without: tuple[int, ...] = (), offset_m: float = 0.0) -> Recording:
        positions = performance.positions
        numbers = np.arange(len(positions))
        rng = np.random.default_rng(1)
        captured = BEGAN_NS + numbers * 10 * MS + rng.integers(0, late_ns + 1, len(numbers))
        sample = 70 + numbers
        steps = steps_of(positions, 0.008)
        ends = [
            int(np.linalg.norm(positions - (s.position + s.displacement), axis=1).argmin())
            for s in steps
        ]
        recognizer = SegmentFilterRecognizer(model)
        recognized = [recognizer.step(step).belief for step in steps]
        step_rows: list[tuple[Any, ...]] = [
            (sample[end], captured[end], captured[end] + MS, s.index, s.position, s.displacement)
            for end, s in zip(ends, steps, strict=True)
        ]
        belief_rows: list[tuple[Any, ...]] = [
            (captured[end] + 4 * MS, b.step, b.states, b.unknown, 0)
            for end, b in zip(ends, recognized, strict=True)
            if b.step not in without
        ]
        return Recording(
            states=np.array(model.state_names),
            motions=table(
                Motions,
                [
                    *[(k, BEGAN_NS - (70 - k) * 10 * MS, 0, positions[0], False) for k in (68, 69)],
                    *[
                        (k, t, t + MS, p + offset_m, True)
                        for k, t, p in zip(sample, captured, positions, strict=True)
                    ],
                ],
            ),
            steps=table(Steps, step_rows),
            beliefs=table(Beliefs, belief_rows),
            commands=table(
                Commands, [(k, t, t + 2 * MS, True) for k, t in zip(sample, captured, strict=True)]
            ),
            fixtures=table(
                Fixtures,
                [
                    (k, t, t + 2 * MS, 0.8, True, "guiding")
                    for k, t in zip(sample, captured, strict=True)
                ],
            ),
            robot=table(
                RobotStates,
                [
                    (
                        k,
                        t,
                        t + (5 + 4 * again) * MS,
                        p + 1.0,
                        v,
                        [3e-3, 0.0, 0.0],
                        False,
                        "none",
                        "",
                    )
                    for k, t, p in zip(sample, captured, positions, strict=True)
                    for again, v in enumerate(np.zeros((2, 3)))
                ],
            ),
            members=table(Members, [(BEGAN_NS, "gesteme-classifier-1", True)]),
        )

    return record


@pytest.fixture
def measured(
    recorded: Callable[..., Recording], performance: Demonstration, model: Model
) -> Measured:
    """The run as it should be."""
    return measure(recorded(), performance, model, RATE_HZ)


@pytest.fixture
def summary(measured: Measured) -> Summary:
    """Its figures, with a classifier killed after 2 s and replaced 0.5 s later."""
    facts = RunFacts(
        killed="gesteme-classifier-1",
        newcomer="gesteme-classifier-3",
        killed_ns=BEGAN_NS + 2000 * MS,
        ready_ns=BEGAN_NS + 2500 * MS,
        cpu_cores=0.4,
        lost_messages=0,
        refused_messages=0,
        held_out=(1, 5),
        seed=1,
        versions={"hmcs": "0.1.0"},
    )
    return summarize(measured, facts)
