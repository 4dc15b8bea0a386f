"""The whole loop on the page: record, label, train, activate, and be recognized.

Buttons and texts are the page's own; the hand, which would take minutes by mouse, is a script that
tells what the page would tell of its handle.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from browser.scripted import Scripted
from browser.viewing import Cell, Viewer
from hmcs.bus.messages import Belief, FixtureState
from support.stack import CELL, Stack

pytestmark = pytest.mark.browser
OpenViewer = Callable[..., Viewer]

STATES = ("out", "up", "back")
TASK = {
    "format": "hmcs-task/1",
    "name": "triangle",
    "dead_zone_m": 0.01,
    "gestemes": [{"name": f"go-{state}"} for state in STATES],
    "states": [
        {"name": "out", "gestemes": ["go-out"], "next": ["up"]},
        {"name": "up", "gestemes": ["go-up"], "next": ["back"]},
        {"name": "back", "gestemes": ["go-back"], "next": ["out"]},
    ],
    "start": ["out"],
    "workspace": {"lower_m": [0.3, -0.5, 0.1], "upper_m": [0.9, 0.5, 0.9], "obstacles": []},
    "robot": {
        "model": "puma560",
        "tool_start_m": [0.6, 0.1, 0.4],
        "tool_orientation_xyzw": [0.0, 0.7071067811865476, 0.0, 0.7071067811865476],
    },
}
CORNERS_M = np.array([[0.6, 0.1, 0.4], [0.6, -0.25, 0.4], [0.6, -0.25, 0.75], [0.6, 0.1, 0.4]])
SPEED_M_S = 0.3
RECOGNIZED = 0.95
DEMONSTRATIONS = 3
TRAINED_S = 120.0


def start(stack: Stack, task: Path, folder: Path) -> Cell:
    """Bring up whoever it takes; the robot is left out, nothing here moves it."""
    trainer = stack._spawn(
        *("trainer", "trainer", "hmcs_trainer", "serve", "--router", stack.endpoint),
        *("--cell", CELL, "--instance", "trainer", "--folder", str(folder / "models")),
        *("--sources", str(folder), "--sources", str(task)),
    )
    cell = Cell(
        stack,
        ("input_device", "--source", "page", "--task", task),
        ("recorder", "--folder", folder, "--no-autostart", "--free-mb", 0),
        ("recognizer",),
        ("fixture_controller",),
        task=task,
    )
    stack.until_ready(trainer)
    return cell


def test_what_is_shown_three_times_is_recognized_the_fourth(
    browser: Any, stack: Stack, open_viewer: OpenViewer, tmp_path: Path
) -> None:
    del browser
    task = tmp_path / "triangle.yaml"
    task.write_text(yaml.safe_dump(TASK), encoding="utf-8")
    cell = start(stack, task, tmp_path / "taught")
    viewer = open_viewer(cell, task=task)
    hand = Scripted(cell.stack, CORNERS_M, STATES, SPEED_M_S)
    rng = np.random.default_rng(7)
    beliefs: dict[int, Belief] = {}
    followed: list[str] = []
    cell.bus.subscribe(
        Belief,
        cell.bus.keys.belief("taught"),
        lambda got: beliefs.update({got.body.step: got.body}),
    )
    cell.bus.subscribe(
        FixtureState, cell.bus.keys.fixture_state, lambda got: followed.append(got.body.model)
    )
    viewer.open_tab("Teach")
    files = []
    for number in range(DEMONSTRATIONS):
        viewer.write("Name", f"show-{number}")
        viewer.press("Begin")
        file = tmp_path / "taught" / f"show-{number}.mcap"
        viewer.until(lambda file=file: viewer.sees(f"recording to {file}"))
        hand.perform(rng, mark=True)
        viewer.press("End")
        viewer.until(lambda file=file: viewer.sees(f"ended {file}"))
        files.append(file)
    viewer.write("Task", str(task))
    viewer.write("Demonstrations", ", ".join(map(str, files)))
    viewer.press("Train")
    viewer.until(lambda: viewer.sees("done:"), within_s=TRAINED_S)
    viewer.press("Activate what was trained")
    viewer.until(lambda: active(cell))
    meant = hand.perform(rng, mark=False)
    stack.until(lambda: set(meant) <= set(beliefs))
    right = [beliefs[step].likely_state == state for step, state in meant.items()]
    print(f"recognized {np.mean(right):.1%} of {len(right)} steps")
    assert len(right) > 60
    assert np.mean(right) >= RECOGNIZED
    assert followed[-1] == "taught"


def active(cell: Cell) -> bool:
    """Whether the fixture follows what was taught."""
    return cell.describe("fixture_controller", "fixture_controller")["active_model"] == "taught"
