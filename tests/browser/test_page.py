"""What is on the page: a scene, and plots that go on; and nothing from elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

from browser.viewing import MANY_COLORS, TASK, Cell, Viewer
from hmcs.bus.messages import Belief
from hmcs.task import load_task
from hmcs_console.shapes.palette import color_of
from support.stack import Stack

pytestmark = pytest.mark.browser
OpenViewer = Callable[..., Viewer]

PLOTTED_PX = 20
"""So many pixels of its color make a curve."""
NEAR = 40
"""Colors differ by so much at edges, summed over red, green and blue."""


@pytest.fixture
def watched(browser: Any, stack: Stack) -> Cell:
    """A console alone."""
    del browser
    return Cell(stack)


def test_the_page_shows_a_scene_and_asks_nobody_but_its_console(
    watched: Cell, open_viewer: OpenViewer
) -> None:
    viewer = open_viewer(watched)
    assert viewer.colors() >= MANY_COLORS
    for tab in ("Plots", "Recognizers", "Teach", "Services", "Operate"):
        viewer.open_tab(tab)
    viewer.until(lambda: viewer.sees("Nobody can operate"))
    console = urlsplit(watched.url).netloc
    asked = [urlsplit(url.removeprefix("blob:")) for url in viewer.requests]
    assert {"http", "ws"} <= {place.scheme for place in asked}
    assert {place.netloc for place in asked if place.scheme != "data"} == {console}


def test_the_plots_go_on_while_beliefs_arrive(watched: Cell, open_viewer: OpenViewer) -> None:
    # Drawn coarsely a curve is thinner than a pixel, and has another color.
    viewer = open_viewer(watched, coarse=1.0)
    viewer.open_tab("Plots")
    plot = viewer.page.locator(".uplot").first
    viewer.until(plot.is_visible)
    states = tuple(state.name for state in load_task(TASK).states)
    count = 0
    beliefs = watched.bus.publisher(Belief, watched.bus.keys.belief("made-up"))

    def believe() -> None:
        nonlocal count
        share = 0.5 + 0.4 * np.sin(0.1 * count)
        probabilities = np.array([share, 1.0 - share, *[0.0] * (len(states) - 2)])
        beliefs.put(
            Belief(
                model_hash="h",
                clock="c",
                step=count,
                states=states,
                probabilities=probabilities,
                likely_gesteme="",
                segment_start=0,
            )
        )
        count += 1

    def pixels_of(state: str) -> int:
        apart = viewer.picture(plot).astype(int) - color_of(state, states)
        return int(np.sum(np.abs(apart).sum(axis=2) < NEAR))

    # The legend shows the color as well.
    before = [pixels_of(state) for state in states[:2]]
    watched.bus.every(0.02, believe)
    for state, had in zip(states[:2], before, strict=True):
        viewer.until(lambda state=state, had=had: pixels_of(state) > had + PLOTTED_PX)
    seen = {viewer.picture(plot).tobytes()}

    def differs() -> bool:
        seen.add(viewer.picture(plot).tobytes())
        return len(seen) > 3

    viewer.until(differs)
