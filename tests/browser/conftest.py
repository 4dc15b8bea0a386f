"""A browser, and pages in it that leave a picture behind."""

from __future__ import annotations

import contextlib
import re
import shutil
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from browser.viewing import TASK, UNHURRIED, Cell, Viewer
from hmcs.task import load_task
from support.stack import PATIENT_ROBOT, Stack

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-quic",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    # Two pages of one test are both in front.
    "--disable-backgrounding-occluded-windows",
    "--disable-renderer-backgrounding",
)
YIELDING = """#!/bin/sh
# Run by root it would put the process that draws before all others.
if [ "$(id -u)" = 0 ] && command -v setpriv >/dev/null; then
  exec setpriv --bounding-set -sys_nice nice -n 10 "{program}" "$@"
fi
exec nice -n 10 "{program}" "$@"
"""
PATIENT_MS = 400
FOLLOWING = (
    # A browser without graphics hardware leaves them little of the machine; whether they stop in
    # time for one another is for other tests to show.
    ("robot", "--task", TASK, *PATIENT_ROBOT, *UNHURRIED),
    (
        "fixture_controller",
        *("--input-stale-after-ms", PATIENT_MS, "--command-valid-for-ms", PATIENT_MS),
    ),
)
OPERATED = (*FOLLOWING, ("input_device", "--source", "page", "--task", TASK))
SLOWLY_M_S = 0.1

OpenViewer = Callable[..., Viewer]


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A chromium that yields to the processes that are tested."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        pytest.skip(f"none of {', '.join(BROWSERS)} is installed")
    yielding = tmp_path_factory.mktemp("browser") / "chromium"
    yielding.write_text(YIELDING.format(program=program), encoding="utf-8")
    yielding.chmod(stat.S_IRWXU)
    with api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=yielding, args=list(FLAGS))
        try:
            yield started
        finally:
            started.close()


@pytest.fixture
def open_viewer(browser: Any, request: pytest.FixtureRequest) -> Iterator[OpenViewer]:
    """Open pages; each is pictured when the test has ended, however it did, and closed."""
    viewers: list[Viewer] = []

    def open_one(cell: Cell, **settings: Any) -> Viewer:
        viewer = Viewer(browser, cell, **settings)
        viewers.append(viewer)
        viewer.open()
        return viewer

    yield open_one
    name = re.sub(r"\W+", "-", request.node.name)
    for number, viewer in enumerate(viewers, start=1):
        with contextlib.suppress(Exception):
            viewer.keep_picture(name if len(viewers) == 1 else f"{name}-{number}")
        with contextlib.suppress(Exception):
            viewer.close()


@pytest.fixture
def following(browser: Any, stack: Stack) -> Cell:
    """A robot that follows whatever device there will be."""
    del browser  # Without one no process needs to be started.
    cell = Cell(stack, *FOLLOWING)
    stack.until(lambda: cell.heard.robot)
    return cell


@pytest.fixture
def operated_slowly(browser: Any, stack: Stack, tmp_path: Path) -> Cell:
    """A robot that follows the handle of the page, and is long on its way."""
    del browser  # Without one no process needs to be started.
    task = load_task(TASK).model_dump(mode="json", exclude_none=True)
    task["robot"]["speed_limit_m_s"] = SLOWLY_M_S
    file = tmp_path / "slow.yaml"
    file.write_text(yaml.safe_dump(task), encoding="utf-8")
    robot = ("robot", "--task", file, *PATIENT_ROBOT, *UNHURRIED)
    cell = Cell(stack, robot, *OPERATED[1:])
    stack.until(lambda: cell.heard.robot)
    return cell


@pytest.fixture
def operated(browser: Any, stack: Stack) -> Cell:
    """A robot that follows the handle of the page."""
    del browser  # Without one no process needs to be started.
    cell = Cell(stack, *OPERATED)
    stack.until(lambda: cell.heard.robot)
    return cell
