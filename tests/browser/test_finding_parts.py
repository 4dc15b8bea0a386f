"""On the page a model finds the parts of a recording, and its report opens beside the page."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from browser.viewing import PICTURES, Cell, Viewer
from hmcs.bus.messages import Label, Motion, Step
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import DeadZone
from hmcs_trainer.training import train
from support.lessons import ROUND, lesson_task, performed
from support.recordings import HAND, KEYS, Maker
from support.stack import CELL, Stack

pytestmark = pytest.mark.browser
OpenViewer = Callable[..., Viewer]

COARSE = float(os.environ.get("PICTURES_COARSE", "0.25"))
WIDE, NARROW = (1280, 800), (390, 844)
FOUND_S = 60.0
SAYS = re.compile(r"first finds \d+% of the labeled time as it is labeled")


def take(folder: Path, name: str, shown: Demonstration) -> Path:
    """Write a recording with the labels of a demonstration."""
    zone, said, before = DeadZone(lesson_task().dead_zone_m), list[Any](), None
    for at, state in zip(shown.positions, shown.states, strict=True):
        if state != before:
            said.append((KEYS.label, Label(state=state or "", clock=HAND.boot, step=zone.count)))
        before = state
        said.append((KEYS.motion, Motion(position=at, velocity=np.zeros(3), dead_man=True)))
        step = zone.push(at)
        if step is not None:
            said.append((KEYS.step, Step(**step._asdict())))
    return Maker(folder).write(said, name)


def start(stack: Stack, folder: Path) -> Cell:
    """Bring up a page that sees recordings, and a model learned from two of the three."""
    task = folder / "lesson.yaml"
    fields = lesson_task().model_dump(mode="json", exclude_defaults=True)
    task.write_text(yaml.safe_dump(fields | {"format": lesson_task().format}), encoding="utf-8")
    takes, models = folder / "takes", folder / "models"
    files = [take(takes, f"take-{number}", performed(number)) for number in (1, 2, 3)]
    models.mkdir()
    train(
        str(task),
        [str(file) for file in files[:2]],
        models / "first.hmcs",
        name="first",
        report=models / "first.html",
    )
    trainer = stack._spawn(
        *("trainer", "trainer", "hmcs_trainer", "serve", "--router", stack.endpoint),
        *("--cell", CELL, "--instance", "trainer", "--folder", str(models)),
        *("--sources", str(takes), "--sources", str(task)),
    )
    cell = Cell(
        stack,
        ("recorder", "--folder", takes, "--no-autostart", "--free-mb", 0),
        task=task,
        console=("--models", f'["{models}"]'),
    )
    stack.until_ready(trainer)
    return cell


def test_a_model_finds_the_parts_of_a_recording_beside_its_labels_and_its_report_opens(
    browser: Any, stack: Stack, open_viewer: OpenViewer, tmp_path: Path
) -> None:
    del browser
    cell = start(stack, tmp_path)
    viewer = open_viewer(cell, task=tmp_path / "lesson.yaml", size=WIDE, coarse=COARSE)
    viewer.open_tab("Recordings")
    viewer.press("Refresh")
    viewer.until(lambda: viewer.sees("Chosen: 0.00 s to"))
    viewer.choose("Recording", "take-3.mcap")
    viewer.until(lambda: viewer.sees("Chosen: 0.00 s to"))
    assert not viewer.sees("Learned from it:")
    viewer.press("Segment")
    viewer.until(lambda: viewer.sees(SAYS), within_s=FOUND_S)
    strips = viewer.page.locator("svg[aria-label^='labels, and what was found']")
    for text in ("labels", "found by first", "time, s"):
        assert strips.get_by_text(text, exact=True).is_visible()
    hints = strips.locator("rect title").all_text_contents()
    parts = [hint.partition(",")[0] for hint in hints if hint.endswith("%")]
    assert tuple(parts) == ROUND
    strips.scroll_into_view_if_needed()
    viewer.keep_picture("segmented")
    viewer.page.set_viewport_size({"width": NARROW[0], "height": NARROW[1]})
    # It lays itself out anew, and turns to its first tab.
    viewer.until(lambda: viewer.sees("How to engage, clutch and stop"))
    viewer.open_tab("Recordings")
    viewer.until(strips.is_visible)
    strips.scroll_into_view_if_needed()
    viewer.keep_picture("segmented-narrow")
    viewer.choose("Recording", "take-1.mcap")
    viewer.until(lambda: viewer.sees(re.compile("Learned from it:")))
    assert strips.count() == 0
    viewer.page.get_by_role("link", name="report").scroll_into_view_if_needed()
    viewer.keep_picture("learned-from-it")
    with viewer.page.context.expect_page() as opened:
        viewer.page.get_by_role("link", name="report").click()
    report = opened.value
    report.wait_for_load_state()
    assert report.url == f"{cell.url}/reports/first.html"
    assert report.locator("h1").text_content() == "Model first"
    assert report.locator("svg").count() == 2
    report.screenshot(path=PICTURES / "report.png", full_page=True)
    report.close()
    viewer.open_tab("Task")
    viewer.until(lambda: viewer.sees("lesson"))
    viewer.keep_picture("task-without-a-model")
