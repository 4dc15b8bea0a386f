"""What a hand feels and signals reaches those who recognize, live and replayed."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.step_feed import FedStep, StepFeed
from hmcs.motion.demonstrations import Demonstration, write_csv
from hmcs.motion.steps import Step
from hmcs.translation import step_of
from support.stack import Stack

LENGTH_M = 0.4
PARTS = 4
DEAD_ZONE_M = 0.01
FULL_PUSH = np.array([4.0, 0.0, -8.0, 0.0, 1.0, 0.0])
FULL_TURN = 2.0


def orientation_at(x_m: float) -> np.ndarray:
    half = FULL_TURN * x_m / LENGTH_M / 2
    return np.array([0.6 * np.sin(half), 0.0, 0.8 * np.sin(half), np.cos(half)])


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A straight motion of four parts, turned and pushed the more the further it has come."""
    share = np.linspace(0, 1, 401)
    demonstration = Demonstration(
        "pushed",
        4.0 * share,
        np.outer(LENGTH_M * share, (1.0, 0.0, 0.0)),
        tuple(f"part-{min(int(PARTS * s), PARTS - 1)}" for s in share),
        np.array([orientation_at(LENGTH_M * s) for s in share]),
        np.outer(share, FULL_PUSH),
    )
    path = tmp_path / "pushed.csv"
    write_csv(path, demonstration)
    return path


def listen(stack: Stack, instance: str) -> list[Step]:
    """Return the list that is filled, while pumped, with the steps a recognizer is handed."""
    heard: list[Step] = []

    def on_step(fed: FedStep) -> None:
        heard.append(step_of(fed.step))

    StepFeed(stack.open_bus("recognizer", instance), logging.getLogger("test"), on_step).begin()
    return heard


def test_orientation_force_and_marks_of_a_recording_arrive_live_and_replayed(
    stack: Stack, file: Path
) -> None:
    live = listen(stack, "live")
    stack.watch(stack.open_bus("test", "watcher"))
    stack.bring_up(
        *("input_device", "i", "--source", "recorded", "--demonstration", file),
        *("--dead-zone-m", DEAD_ZONE_M, "--mark-switches"),
    )
    stack.until(lambda: len(live) > LENGTH_M / DEAD_ZONE_M / 2)
    replayed = listen(stack, "late")
    assert len(replayed) > 3
    # A busy machine may skip samples, and steps are longer then.
    stack.until(
        lambda: live[-1].position[0] > LENGTH_M - 3 * DEAD_ZONE_M and len(live) == len(replayed)
    )
    for step, again in zip(live, replayed, strict=True):
        for name in Step._fields:
            np.testing.assert_array_equal(getattr(step, name), getattr(again, name))

    for step in live:
        begin_m = step.position[0]
        end_m = begin_m + step.displacement[0]
        np.testing.assert_allclose(step.orientation, orientation_at(end_m), atol=1e-4)
        assert step.wrench is not None
        share = step.wrench @ FULL_PUSH / (FULL_PUSH @ FULL_PUSH)
        np.testing.assert_allclose(step.wrench, share * FULL_PUSH, atol=1e-12)
        assert begin_m <= share * LENGTH_M <= end_m
    marked_m = [(s.position[0], s.position[0] + s.displacement[0]) for s in live if s.mark]
    assert len(marked_m) == PARTS
    for k, (begin_m, end_m) in enumerate(marked_m):
        # The pedal stays down for a moment: the sample that shows it first may come late.
        assert begin_m - 3 * DEAD_ZONE_M <= k * LENGTH_M / PARTS < end_m
