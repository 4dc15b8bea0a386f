"""The deviation is heard by who wants to hear it: a tone that plays, and falls silent again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from browser.viewing import Cell, Viewer
from hmcs.bus.messages import FixtureState
from support.stack import Stack

pytestmark = pytest.mark.browser
OpenViewer = Callable[..., Viewer]

NEAR_M, FAR_M = 0.001, 0.1
HEARD = """() => {
    const tone = document.querySelector("audio");
    return tone && !tone.paused && tone.currentTime > 0 ? tone.outerHTML : "";
}"""


class Fixture:
    """Somebody who says again and again how far the robot is beside its guide."""

    def __init__(self, cell: Cell, off_guide_m: float) -> None:
        self.off_guide_m = off_guide_m
        self._states = cell.bus.publisher(FixtureState, cell.bus.keys.fixture_state)
        cell.bus.every(0.05, self._tell)

    def _tell(self) -> None:
        still = np.zeros(6)
        self._states.put(
            FixtureState(
                law="general",
                model="made-up",
                state="s",
                factor=0.5,
                compliance=0.5,
                preferred_direction=np.zeros(3),
                progress=0.5,
                gesteme="g",
                guide_origin=np.zeros(3),
                off_guide_m=self.off_guide_m,
                operator_twist=still,
                command_twist=still,
                wrench=still,
                engaged=True,
                reason="guiding",
            )
        )


def test_the_tone_of_a_deviation_plays_for_who_switched_it_on(
    browser: Any, stack: Stack, open_viewer: OpenViewer
) -> None:
    del browser  # Without one no process needs to be started.
    cell = Cell(stack)
    fixture = Fixture(cell, FAR_M)
    viewer, other = open_viewer(cell), open_viewer(cell)

    def heard(page: Viewer) -> str:
        return str(page.page.evaluate(HEARD))

    viewer.until(lambda: viewer.sees("100.0 mm beside it"))
    assert heard(viewer) == ""
    viewer.page.get_by_label("Tone").click()
    viewer.until(lambda: heard(viewer))
    highest = heard(viewer)
    fixture.off_guide_m = 0.01
    viewer.until(lambda: heard(viewer) not in ("", highest))
    fixture.off_guide_m = NEAR_M
    viewer.until(lambda: viewer.page.locator("audio").count() == 0)
    assert other.page.locator("audio").count() == 0
    fixture.off_guide_m = FAR_M
    viewer.until(lambda: heard(viewer) == highest)
    viewer.page.get_by_label("Tone").click()
    viewer.until(lambda: viewer.page.locator("audio").count() == 0)
