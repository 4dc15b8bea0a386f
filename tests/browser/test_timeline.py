"""A recording is labeled on the page, and the file beside it says so."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from browser.viewing import Cell, Viewer
from hmcs.recordings.labels import labels_beside
from hmcs.recordings.reading import read
from support.recordings import Maker, hand_of
from support.stack import Stack

pytestmark = pytest.mark.browser
OpenViewer = Callable[..., Viewer]

TASK = "lines-through-obstacles"
"""Its states are lift, carry, …."""


def written(recording: Path) -> list[tuple[float, float, str]]:
    """What the file beside a recording says beside its remarks; nothing where there is none."""
    beside = labels_beside(recording)
    if not beside.exists():
        return []
    with beside.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(line for line in stream if not line.startswith("#")))
    return [(float(row["begin_s"]), float(row["end_s"]), row["state"]) for row in rows]


def move_thumb(viewer: Viewer, number: int, share: float, reads: str) -> None:
    """Drag a thumb of the slider to a share of its length, until the page reads as it should."""
    track = viewer.page.locator(".multi-slider-track-container").filter(visible=True)
    thumb = viewer.page.locator(".multi-slider-thumb").filter(visible=True).nth(number)
    thumb.scroll_into_view_if_needed()
    length, at, mouse = track.bounding_box(), thumb.bounding_box(), viewer.page.mouse
    assert length is not None
    assert at is not None
    height, goal = at["y"] + at["height"] / 2, length["x"] + share * length["width"]
    mouse.move(at["x"] + at["width"] / 2, height)
    mouse.down()

    def there() -> bool:
        # A page without graphics hardware may leave out where the mouse was in between.
        mouse.move(goal + 2, height)
        mouse.move(goal, height)
        return viewer.sees(re.compile(reads))

    viewer.until(there)
    mouse.up()


def test_a_recording_is_labeled_on_the_page_and_the_file_beside_it_says_so(
    browser: Any, stack: Stack, open_viewer: OpenViewer, tmp_path: Path
) -> None:
    del browser
    said = [(key, body) for key, body in hand_of((None, None), 200) if "label" not in key]
    recording = Maker(tmp_path / "takes").write(said)
    lasts_s = read(recording).duration_s
    folder = ("--folder", recording.parent, "--no-autostart", "--free-mb", 0)
    cell = Cell(stack, ("recorder", *folder), task=TASK)
    viewer = open_viewer(cell, task=TASK)
    viewer.open_tab("Recordings")
    viewer.press("Refresh")
    viewer.until(lambda: viewer.sees("Chosen: 0.00 s to"))
    move_thumb(viewer, 1, 0.5, r"Chosen: 0\.00 s to 2\.[34]\d s")
    viewer.press("Label")
    viewer.until(lambda: viewer.sees("'lift' from 0.000 s to"))
    move_thumb(viewer, 1, 1.0, rf"Chosen: 0\.00 s to {lasts_s:.2f} s")
    move_thumb(viewer, 0, 0.5, rf"Chosen: 2\.[34]\d s to {lasts_s:.2f} s")
    viewer.choose("State", "carry")
    viewer.press("Label")
    viewer.until(lambda: viewer.sees("'carry' from 2."))
    assert written(recording) == []
    viewer.press("Save")
    viewer.until(lambda: viewer.sees("2 labels written"))
    (begins, turns, first), (turned, ends, second) = written(recording)
    assert (first, second) == ("lift", "carry")
    assert begins == 0.0
    assert turns == turned == pytest.approx(lasts_s / 2, abs=lasts_s / 20)
    assert ends == pytest.approx(lasts_s)
    viewer.press("Use for training")
    viewer.keep_picture("timeline")
    viewer.press("Hide")
    viewer.until(lambda: not viewer.sees("Chosen:"))
    viewer.open_tab("Teach")
    viewer.until(lambda: viewer.written("Demonstrations") == str(recording))
