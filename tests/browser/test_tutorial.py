"""The tutorial as it stands in docs/teach-your-own-task.md, from an empty folder to assistance.

Its commands, its buttons, its texts; the hand that demonstrates is a script, and faster than one.
"""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from browser.scripted import Scripted
from browser.viewing import Heard, Viewer
from hmcs.bus.messages import FixtureState
from hmcs.task import load_task
from support.stack import CELL, DEADLINE_S, Stack, clean_environment

pytestmark = pytest.mark.browser
OpenViewer = Callable[..., Viewer]

TUTORIAL = Path(__file__).parents[2] / "docs" / "teach-your-own-task.md"
COMMANDS = ("hmcs new my-task --states take,bring,set", "hmcs up my-task.yaml")
"""All that is typed, each in the tutorial."""
STATES = ("take", "bring", "set")
WAY_M = np.array(
    [[0.0, 0.0, 0.0], [0.0, 0.0, -0.15], [0.0, 0.2, -0.15], [0.1, 0.2, -0.05], [0.0, 0.2, 0.0]]
)
"""The last part ends before the hand does."""
SPEED_M_S = 0.13
"""In 4 s it shows what takes a hand 20."""
DEMONSTRATIONS = 3
MOST_TAKES = 12
"""One that a machine that stood still has spoiled is given again, as a person would."""
TRAINED_S = 180.0
GUIDED_S = 120.0
PAGE = re.compile(r"http://127\.0\.0\.1:\d+")
WIDE, NARROW = (1280, 800), (390, 844)


class Up:
    """A stack that `hmcs up` brought up in a folder, and somebody who listens to it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.stack = Stack(folder)
        """Of processes of its own it has none; its router is that of `hmcs up`."""
        self._log = (folder / "up.log").open("w+b")
        self._process = subprocess.Popen(
            hmcs("up", "my-task.yaml", "--router", self.stack.endpoint),
            cwd=folder,
            env=self.environment,
            stdout=self._log,
            stderr=subprocess.STDOUT,
        )

    @property
    def environment(self) -> dict[str, str]:
        """Of every command in the folder."""
        of_cell = {"HMCS_CELL": CELL, "HMCS_ROUTER": self.stack.endpoint}
        return clean_environment() | of_cell

    def join(self) -> None:
        """Listen, once it has printed where its page is."""
        self.url = self._printed()
        self.bus = self.stack.open_bus("observer", "o")
        self.stack.watch(self.bus)
        self.heard = Heard(self.bus)
        self.fixture: list[FixtureState] = []
        self.bus.subscribe(
            FixtureState, self.bus.keys.fixture_state, lambda got: self.fixture.append(got.body)
        )
        self.stack.until(lambda: self.heard.robot)

    def close(self) -> None:
        """End it as Ctrl-C does."""
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(DEADLINE_S)
        finally:
            self._process.kill()
            self.stack.close()
            self._log.close()

    def _printed(self) -> str:
        deadline_s = time.monotonic() + 3 * DEADLINE_S
        while True:
            said = Path(self._log.name).read_text(encoding="utf-8")
            assert self._process.poll() is None, said
            if found := PAGE.search(said):
                return found[0]
            assert time.monotonic() < deadline_s, said
            time.sleep(0.02)


def hmcs(*words: object) -> list[str]:
    return [sys.executable, "-m", "hmcs_local.command", *map(str, words)]


def run(folder: Path, environment: dict[str, str], words: Sequence[object]) -> None:
    done = subprocess.run(
        hmcs(*words), cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


class Clock:
    """What of the time since the beginning was the machine's, and not the hand's."""

    def __init__(self) -> None:
        self._began_s = time.monotonic()
        self._hand_s = 0.0
        self.laps: list[str] = []

    def hand(self, act: Callable[[], Any]) -> Any:
        began_s = time.monotonic()
        try:
            return act()
        finally:
            self._hand_s += time.monotonic() - began_s

    @property
    def machine_s(self) -> float:
        return time.monotonic() - self._began_s - self._hand_s

    def lap(self, what: str) -> None:
        self.laps.append(f"{what} {self.machine_s:.1f} s")


@pytest.fixture
def up(browser: Any, tmp_path: Path) -> Iterator[Callable[[], Up]]:
    del browser  # Without one no process needs to be started.
    made: list[Up] = []

    def bring_up() -> Up:
        made.append(Up(tmp_path))
        return made[-1]

    yield bring_up
    for each in made:
        each.close()


def test_the_tutorial_leads_from_an_empty_folder_to_assistance(
    up: Callable[[], Up], open_viewer: OpenViewer, tmp_path: Path
) -> None:
    for command in COMMANDS:
        assert command in TUTORIAL.read_text(encoding="utf-8")
    assert list(tmp_path.iterdir()) == []
    clock = Clock()
    run(tmp_path, clean_environment(), COMMANDS[0].split()[1:])
    clock.lap("new")
    cell = up()
    cell.join()
    clock.lap("up")
    task = tmp_path / "my-task.yaml"
    viewer = open_viewer(cell, task=task, size=WIDE)
    clock.lap("page")
    start_m = np.array(load_task(task).robot.tool_start_m)
    hand = Scripted(cell.stack, start_m + WAY_M, (*STATES, ""), SPEED_M_S)
    rng = np.random.default_rng(7)
    viewer.open_tab("Task")
    viewer.until(lambda: viewer.sees("my-task"))
    viewer.open_tab("Teach")
    names = list[str]()
    for number in range(1, MOST_TAKES + 1):
        name = f"take-{number}"
        viewer.write("Name", name)
        viewer.press("Begin")
        viewer.until(lambda name=name: viewer.sees(re.compile(f"recording to .*{name}.mcap")))
        if clock.hand(lambda: hand.perform(rng, mark=True)):
            viewer.until(lambda: viewer.sees(re.compile("nothing is marked")))
            names.append(name)
        viewer.press("End")
        viewer.until(lambda name=name: viewer.sees(re.compile(f"ended .*{name}.mcap")))
        if len(names) == DEMONSTRATIONS:
            break
    assert len(names) == DEMONSTRATIONS
    clock.lap("taught")
    viewer.write("Model", "first")
    for name in names:
        viewer.choose("Add recording", f"{name}.mcap")
        viewer.until(lambda name=name: name in viewer.written("Demonstrations"))
    viewer.press("Train")
    viewer.until(lambda: viewer.sees("done:"), within_s=TRAINED_S)
    clock.lap("trained")
    viewer.keep_picture("tutorial-trained")
    viewer.press("Activate what was trained")
    viewer.until(lambda: cell.fixture[-1].model == "first", within_s=DEADLINE_S)
    clock.lap("activated")
    cell.fixture.clear()
    viewer.open_tab("Operate")
    until_s = time.monotonic() + GUIDED_S
    while not guided(cell) >= set(STATES):
        # A machine that is busy with the page is late now and then, and the fixture gives way.
        seen = Counter((each.reason, each.state) for each in cell.fixture)
        assert time.monotonic() < until_s, seen
        clock.hand(lambda: hand.perform(rng, mark=False, parts=len(STATES)))
    clock.lap("assisted")
    print("machine time:", ", ".join(clock.laps))
    viewer.keep_picture("tutorial-assisted")
    look_afterwards(viewer, names)
    deploy_from_elsewhere(cell, viewer, names)


def guided(cell: Up) -> set[str]:
    """The states in which the fixture has guided."""
    return {each.state for each in cell.fixture if each.reason == "guiding"}


def look_afterwards(viewer: Viewer, names: Sequence[str]) -> None:
    """What was taught is shown with its model and its report."""
    viewer.open_tab("Recordings")
    viewer.choose("Recording", f"{names[-1]}.mcap")
    viewer.until(lambda: viewer.sees(re.compile("Learned from it:")))
    assert viewer.page.get_by_role("link", name="report").is_visible()
    viewer.press("Segment")
    viewer.until(lambda: viewer.sees(re.compile(r"first finds \d+% of the labeled time")))
    viewer.keep_picture("tutorial-recordings")


def deploy_from_elsewhere(cell: Up, viewer: Viewer, names: Sequence[str]) -> None:
    """A model that lies in no folder of the stack takes over, and the page shows its task."""
    recordings = [f"out/up/recordings/{name}.mcap" for name in names]
    elsewhere = cell.folder / "elsewhere" / "second.hmcs"
    words = ("train", "my-task.yaml", *recordings, "--name", "second", "--output", elsewhere)
    run(cell.folder, cell.environment, (*words, "--no-report"))
    run(cell.folder, cell.environment, ("deploy", elsewhere, "--watch-s", 0))
    viewer.open_tab("Task")
    viewer.until(lambda: cell.fixture and cell.fixture[-1].model == "second")
    viewer.until(lambda: viewer.sees("my-task") and not viewer.sees(re.compile("not known here")))
    viewer.keep_picture("tutorial-deployed")
