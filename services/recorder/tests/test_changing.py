"""Recordings are renamed, deleted and noted, with what is beside them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from hmcs.bus.keys import KeyNameError
from hmcs.bus.messages import ChangeRecording
from hmcs.bus.session import RequestRefusedError
from hmcs.recordings.labels import labels_beside
from hmcs_recorder.changing import LONGEST_NOTE, changed, note_beside, note_of
from hmcs_recorder.settings import RecorderSettings


@pytest.fixture
def take(tmp_path: Path) -> Path:
    path = tmp_path / "take.mcap"
    path.write_bytes(b"recorded")
    labels_beside(path).write_text("labels", encoding="utf-8")
    return path


def change(take: Path, what: Any, text: str = "", running: Path | None = None) -> str:
    asked = ChangeRecording(recording=take.name, change=what, text=text)
    return changed(RecorderSettings(folder=take.parent), asked, running).detail


def test_labels_and_note_are_renamed_with_a_recording(take: Path) -> None:
    change(take, "note", "with the left hand")
    assert change(take, "rename", "slow-1") == "take.mcap is slow-1.mcap now"
    slow = take.with_name("slow-1.mcap")
    assert slow.read_bytes() == b"recorded"
    assert labels_beside(slow).read_text(encoding="utf-8") == "labels"
    assert note_of(slow) == "with the left hand"
    assert not take.exists()
    assert not labels_beside(take).exists()
    assert not note_beside(take).exists()


def test_nothing_is_renamed_over_another_or_out_of_the_folder(take: Path) -> None:
    there = sorted(take.parent.iterdir())
    with pytest.raises(RequestRefusedError, match="already"):
        change(take, "rename", "take")
    for name in ("../outside", "", "a/b", "."):
        with pytest.raises(KeyNameError):
            change(take, "rename", name)
    labels_beside(take.with_name("other.mcap")).write_text("of another", encoding="utf-8")
    with pytest.raises(RequestRefusedError, match=r"other\.labels"):
        change(take, "rename", "other")
    assert set(there) < set(take.parent.iterdir())


def test_a_recording_is_deleted_with_what_is_beside_it_and_no_other(take: Path) -> None:
    other = take.with_name("other.mcap")
    other.write_bytes(b"kept")
    change(take, "note", "bad")
    assert change(take, "delete") == "deleted take.mcap"
    assert list(take.parent.iterdir()) == [other]


def test_what_is_being_recorded_stays_as_it_is(take: Path) -> None:
    for what in ("rename", "delete", "note"):
        with pytest.raises(RequestRefusedError, match="end it first"):
            change(take, what, "slow-1", running=take)
    assert take.read_bytes() == b"recorded"


def test_a_note_is_written_beside_a_recording_and_an_empty_one_taken_away(take: Path) -> None:
    assert note_of(take) == ""
    change(take, "note", "slower than usual")
    assert note_of(take) == "slower than usual"
    with pytest.raises(RequestRefusedError, match="at most"):
        change(take, "note", "x" * (LONGEST_NOTE + 1))
    assert note_of(take) == "slower than usual"
    change(take, "note", " ")
    assert not note_beside(take).exists()
