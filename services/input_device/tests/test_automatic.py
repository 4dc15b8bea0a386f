"""The source `auto`: what is there is played, else the page moves the hand."""

from __future__ import annotations

from pathlib import Path

import pytest

from hmcs.task import load_task
from hmcs_input_device.automatic import chosen
from hmcs_input_device.settings import InputDeviceSettings

TASK = load_task("human-shapes")
WAITS = ("task_hmm", "robot")


@pytest.mark.parametrize("given", ["file", "folder"])
def test_a_demonstration_that_is_there_is_played(tmp_path: Path, given: str) -> None:
    file = tmp_path / "human-shapes.csv"
    file.write_text("t,x,y,z\n")
    settings = InputDeviceSettings(
        source="auto", demonstration=file if given == "file" else tmp_path, wait_for=WAITS
    )
    made = chosen(settings, TASK)
    assert (made.source, made.demonstration, made.wait_for) == ("recorded", file, WAITS)


@pytest.mark.parametrize("place", [None, "", "gone.csv"])
def test_without_one_a_page_moves_the_hand_and_waits_for_nobody(
    tmp_path: Path, place: str | None
) -> None:
    demonstration = None if place is None else tmp_path / place
    made = chosen(
        InputDeviceSettings(source="auto", demonstration=demonstration, wait_for=WAITS), TASK
    )
    assert (made.source, made.demonstration, made.wait_for) == ("page", None, ())


def test_another_source_stays_and_its_folder_becomes_the_file_of_the_task(tmp_path: Path) -> None:
    settings = InputDeviceSettings(source="recorded", demonstration=tmp_path, wait_for=WAITS)
    made = chosen(settings, TASK)
    assert made == settings.model_copy(update={"demonstration": tmp_path / "human-shapes.csv"})
