"""The pictures of the documents, taken of a page that looks at a stack at work.

`make pictures` puts them into `docs/`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from browser.viewing import TASK, UNHURRIED, Cell, Viewer
from hmcs.recordings.labels import write_labels
from hmcs.recordings.reading import read
from hmcs.recordings.stretches import Stretch
from hmcs.task import load_task
from hmcs_trainer.performance import perform
from hmcs_trainer.training import train
from support.recordings import Maker, hand_of
from support.stack import PATIENT_FIXTURE, PATIENT_ROBOT, Stack

pytestmark = pytest.mark.browser
OpenViewer = Callable[..., Viewer]

SIZE = (1100, 640)
SHAPES = ("GShape", "NShape", "PShape", "JShape", "Snake")
LEAST_COLORS = 1000
COARSE = float(os.environ.get("PICTURES_COARSE", "0.25"))
"""Pictures for the documents have every pixel, which takes minutes without graphics hardware."""


def test_a_page_that_looks_at_a_stack_at_work_can_be_pictured(
    browser: Any, stack: Stack, open_viewer: OpenViewer, tmp_path: Path
) -> None:
    del browser
    model, performance = tmp_path / "human-shapes.hmcs", tmp_path / "performance.csv"
    train(TASK, [f"lasa:{shape}/1-5" for shape in SHAPES], model)
    perform(load_task(TASK), [f"lasa:{shape}/6" for shape in SHAPES], performance, ring=True)
    takes = label_a_take(tmp_path / "takes")
    cell = Cell(
        stack,
        ("robot", "--task", TASK, *PATIENT_ROBOT, *UNHURRIED),
        ("recognizer", "--model", model),
        ("fixture_controller", "--models", f'["{model}"]', *PATIENT_FIXTURE),
        ("recorder", "--folder", takes, "--no-autostart", "--free-mb", 0),
        (
            "input_device",
            *("--source", "recorded", "--demonstration", performance),
            *("--task", TASK, "--rate-hz", 30, "--repeat", 0, "--re-engage"),
        ),
        console=("--models", f'["{model}"]'),
    )
    viewer = open_viewer(cell, size=SIZE, coarse=COARSE)
    warning = viewer.page.locator(".mantine-Notification-root")
    # On a page without graphics hardware it may be on its way for longer than a click waits.
    warning.get_by_role("button").dispatch_event("click")
    viewer.until(lambda: warning.count() == 0)
    viewer.until(lambda: viewer.sees(re.compile(r"factor 0\.[789]")), within_s=60.0)
    keep(viewer, "page")
    viewer.open_tab("Plots")
    viewer.until(lambda: viewer.sees("latency, ms"))
    keep(viewer, "page-plots")
    viewer.open_tab("Teach")
    keep(viewer, "page-teach")
    viewer.open_tab("Recordings")
    viewer.press("Refresh")
    viewer.until(lambda: viewer.sees("Chosen: 0.00 s to"))
    keep(viewer, "page-recordings")


def label_a_take(folder: Path) -> Path:
    """Make a recording up with labels of the task beside it; return its folder."""
    said = [(key, body) for key, body in hand_of((None, None), 200) if "label" not in key]
    content = read(Maker(folder).write(said))
    states = [state.name for state in load_task(TASK).states[:3]]
    ends = np.linspace(content.first_ns, content.last_ns, len(states) + 1).astype(int).tolist()
    stretches = [
        Stretch(begin, end, state)
        for begin, end, state in zip(ends[:-1], ends[1:], states, strict=True)
    ]
    write_labels(content, stretches)
    return content.path.parent


def keep(viewer: Viewer, name: str) -> None:
    """Keep a picture once the page has drawn what it shows."""
    viewer.until(lambda: len(np.unique(viewer.picture().reshape(-1, 3), axis=0)) > LEAST_COLORS)
    viewer.keep_picture(name)
