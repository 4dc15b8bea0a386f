"""Whatever is published, named or answered: no program of its own runs in the operator's browser.

The policy the page comes with is switched off where texts are tried, so that it alone is no reason
for nothing to have happened; another test tries the policy by itself.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

import pytest

from browser.viewing import Cell, Viewer
from hmcs.bus.messages import (
    Ask,
    Belief,
    Done,
    Evidence,
    FixtureState,
    Health,
    Message,
    Outline,
    OutlineQuestion,
    Record,
    RobotDescription,
    RobotState,
    TrainingProgress,
)
from hmcs.bus.session import RequestRefusedError
from hmcs.shown import plain
from support.stack import Stack
from support.texts import EXAMPLE_OF, HOSTILE, fields, filled

pytestmark = pytest.mark.browser
OpenViewer = Callable[..., Viewer]

MODEL = "demo"
AGAIN_S = 0.1
JOINER = "\u2060"
LOOK = """() => document.body.innerText + [...document.querySelectorAll("input")].map(
  input => "\\n" + input.value).join("")"""
KEPT_AS_NAMES = {("Belief", ("model_hash",)), ("Belief", ("clock",))}
"""By which beliefs are distinguished."""
TRIED = tuple(text for text in HOSTILE if re.search(r"ran|evil|display|passwd|\*|\u202e", text))
"""Those that would do something in a browser; the others are tried without one."""
DRAWN_S = 60.0
PRESSED_AGAIN_S = 10.0
"""Who waits so long for what a button does presses it again: a page that draws slowly holds up
the stranger in this process, too, and nobody waits long for an answer."""


class Stranger:
    """Whoever says something on the bus: a robot, a fixture, a recognizer, a trainer, a recorder.

    Each text field of what they say holds the same text.
    """

    def __init__(self, stack: Stack) -> None:
        self.text = ""
        self.refuses = False
        self.buses = {name: stack.open_bus(name, "stranger") for name in ("robot", "recorder")}
        bus = self.buses["robot"]
        keys = bus.keys
        self._published = [
            (bus.publisher(FixtureState, keys.fixture_state), FixtureState),
            (bus.publisher(RobotState, keys.robot_state), RobotState),
            (bus.publisher(Belief, keys.belief(MODEL)), Belief),
            (bus.publisher(Evidence, keys.evidence(MODEL, "stranger")), Evidence),
            (bus.publisher(TrainingProgress, keys.training), TrainingProgress),
        ]
        bus.answer("looks", Ask, lambda _: self.saying(RobotDescription))
        bus.answer("stop", Ask, lambda _: self.saying(Done))
        recorder = self.buses["recorder"]
        recorder.answer("outline", OutlineQuestion, lambda _: self.saying(Outline))
        recorder.answer("record", Record, self._record)
        for name, its in self.buses.items():
            its.answer("health", Ask, lambda _: self.saying(Health))
            its.announce(its.keys.presence(name, "stranger"))
        self.follows = MODEL
        bus.every(AGAIN_S, self._publish)

    def saying(self, kind: type[Message]) -> Any:
        said: Any = EXAMPLE_OF[kind]
        for its, path in fields():
            if its is kind and (kind.__name__, path) not in KEPT_AS_NAMES:
                said = filled(said, path, self.text)
        return said

    def _publish(self) -> None:
        if not self.text:
            return
        for publisher, kind in self._published:
            said = self.saying(kind)
            if kind is FixtureState and self.follows:
                said = said.model_copy(update={"model": self.follows})
            publisher.put(said)

    def _record(self, _: Record) -> Done:
        if self.refuses:
            raise RequestRefusedError(self.text)
        return Done(detail=self.text)


@pytest.fixture
def shown(browser: Any, stack: Stack) -> Cell:
    del browser
    return Cell(stack, task=None)


def on_page(viewer: Viewer) -> str:
    """What a person can read, blanks run together."""
    reported = viewer.page.evaluate(LOOK)
    return " ".join(str(reported).replace(JOINER, "").split())


def until_read(viewer: Viewer, text: str, after: str = "", press: str = "") -> None:
    """Wait, a button pressed, until a text can be read as it is, or as an error quotes it."""
    wanted = [after + " ".join(said.split()) for said in (plain(text), repr(text)[1:-1])]
    press_s = time.monotonic() if press else math.inf
    deadline_s = time.monotonic() + DRAWN_S
    while True:
        if time.monotonic() >= press_s:
            viewer.press(press)
            press_s = time.monotonic() + PRESSED_AGAIN_S
        reported = on_page(viewer)
        if any(said in reported for said in wanted):
            return
        assert time.monotonic() < deadline_s, f"none of {wanted} can be read on {reported!r}"
        viewer.cell.stack.elapse(AGAIN_S)


def is_harmless(viewer: Viewer) -> None:
    page = viewer.page
    assert page.evaluate("window.ran") is None
    for made in ("iframe", "img", "script[src]", "a[href]", "style:not(head style)", "svg[onload]"):
        found = page.locator(made)
        outside = [found.nth(k).evaluate("it => it.outerHTML") for k in range(found.count())]
        assert not [it for it in outside if re.search(r"evil|top\.ran|\{display:none\}", it)]
    console = urlsplit(viewer.cell.url).netloc
    asked = [urlsplit(url.removeprefix("blob:")) for url in viewer.requests]
    assert {place.netloc for place in asked if place.scheme != "data"} <= {console}
    assert viewer.page.get_by_role("button", name="Stop", exact=True).is_visible()


TABS = ("Plots", "Operate", "Teach", "Recordings", "Services")


def test_no_text_of_any_message_is_more_than_a_text(
    shown: Cell, stack: Stack, open_viewer: OpenViewer
) -> None:
    stranger = Stranger(stack)
    viewer = open_viewer(shown, bypass_csp=True)
    dialogs: list[str] = []
    viewer.page.on("dialog", lambda dialog: dialogs.append(dialog.message))
    errors: list[str] = []
    viewer.page.on("pageerror", lambda error: errors.append(str(error)))
    for tab in TABS:
        viewer.open_tab(tab)
        # A console without a task keeps the states of whoever believed first.
        for text in TRIED[:1] if tab == "Plots" else TRIED:
            stranger.text = text
            if tab == "Recordings":
                viewer.press("Refresh")
            until_read(viewer, text)
            is_harmless(viewer)
    assert dialogs == errors == []


def test_nor_is_what_the_fixture_follows_or_what_comes_of_a_request(
    shown: Cell, stack: Stack, open_viewer: OpenViewer
) -> None:
    stranger = Stranger(stack)
    stranger.follows = ""
    viewer = open_viewer(shown, bypass_csp=True)
    viewer.open_tab("Recognizers")
    for text in TRIED:
        stranger.text = text
        until_read(viewer, text, after="follows ")
        until_read(viewer, text, after="robot stranger ", press="Stop")
        is_harmless(viewer)
    viewer.open_tab("Teach")
    for text in TRIED:
        stranger.text = text
        stranger.refuses = not stranger.refuses
        after = "recorder refused: " if stranger.refuses else ""
        until_read(viewer, text, after=after, press="Begin")
        is_harmless(viewer)


NAMES = ("robot/evil name", "robot/<img src=x onerror=top.ran=1>", "console/" + "y" * 400)


def test_names_that_are_none_end_nothing_and_are_not_seen(
    shown: Cell, stack: Stack, open_viewer: OpenViewer
) -> None:
    bus = stack.open_bus("stranger", "s")
    for name in NAMES:
        bus.announce(f"{bus.keys.presence('x', 'y').rpartition('/x/')[0]}/{name}")
    Stranger(stack)
    viewer = open_viewer(shown, bypass_csp=True)
    viewer.open_tab("Services")
    viewer.until(lambda: "robot/stranger" in on_page(viewer), DRAWN_S)
    reported = on_page(viewer)
    assert not any(word in reported for word in ("evil", "onerror", "yyy"))
    is_harmless(viewer)


INJECTED = """() => {
  const place = document.createElement("div");
  place.innerHTML = '<iframe srcdoc="<script>top.ran=1</script>"></iframe>'
    + '<img src="x" onerror="top.ran=1"><img src="http://evil.example/a.png">'
    + '<svg onload="top.ran=1"></svg><form action="http://evil.example"><button id="b"></form>';
  document.body.append(place);
  document.getElementById("b").click();
  fetch("http://evil.example/").then(() => { top.reached = 1; }, () => { top.kept = 1; });
}"""


def test_a_program_that_came_into_the_page_all_the_same_would_not_run_nor_reach_anybody(
    shown: Cell, open_viewer: OpenViewer
) -> None:
    viewer = open_viewer(shown)
    refused: list[str] = []
    viewer.page.on("console", lambda message: refused.append(message.text))
    viewer.page.evaluate(INJECTED)
    viewer.until(lambda: viewer.page.evaluate("window.kept"))
    viewer.until(lambda: len([text for text in refused if "Content Security Policy" in text]) >= 4)
    assert viewer.page.evaluate("window.ran") is None
    assert viewer.page.evaluate("window.reached") is None
