"""Recordings go on in new files, and end before the disk is full."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from hmcs.errors import UserError
from hmcs.recordings.file_rotation import NoRoomError
from hmcs.recordings.reading import read
from support.recordings import BEGUN_NS, KEYS, PERIOD_NS, ROOMY, Maker, Said


def test_a_recording_goes_on_in_a_new_file_by_time_and_nothing_is_lost(
    maker: Maker, performed: Callable[..., list[Said]]
) -> None:
    said = performed()
    maker.write(said, limits=ROOMY._replace(part_s=40 * PERIOD_NS / 1e9))
    parts = sorted(maker.folder.glob("take*.mcap"))
    assert [part.name for part in parts][:2] == ["take-002.mcap", "take-003.mcap"]
    contents = [read(part) for part in [parts[-1], *parts[:-1]]]
    assert all(content.whole and content.metadata for content in contents)
    assert sum(len(content.messages) for content in contents) == len(said)


def test_a_recording_goes_on_in_a_new_file_by_size(
    maker: Maker, performed: Callable[..., list[Said]]
) -> None:
    maker.write(performed(samples=300), limits=ROOMY._replace(part_mb=0.004), flush_every=20)
    assert len(list(maker.folder.glob("take*.mcap"))) > 2


def test_where_recordings_fill_their_limit_recording_ends_and_nothing_is_deleted(
    maker: Maker, performed: Callable[..., list[Said]]
) -> None:
    maker.write(performed(), name="old")
    with pytest.raises(NoRoomError, match=r"limit_mb"):
        maker.begin("new", ROOMY._replace(limit_mb=0.001))
    assert [file.name for file in maker.folder.iterdir()] == ["old.mcap"]


def test_room_on_the_disk_is_left_to_others(maker: Maker) -> None:
    with pytest.raises(NoRoomError, match="free_mb"):
        maker.begin("new", ROOMY._replace(free_mb=1e9))


def test_a_recording_is_never_written_over(maker: Maker) -> None:
    maker.write([], name="take")
    with pytest.raises(UserError, match="there is a recording already"):
        maker.begin("take")


def test_numbers_that_are_none_are_refused_and_the_recording_goes_on(
    maker: Maker, performed: Callable[..., list[Said]]
) -> None:
    recording = maker.begin()
    good = performed()[0][1]
    bad = maker.fields(good, 0)
    bad["position"] = [float("nan"), 0.0, 0.0]
    with pytest.raises(ValueError, match="JSON"):
        recording.write(KEYS.motion, bad, BEGUN_NS, None)
    recording.write(KEYS.motion, maker.fields(good, 1), BEGUN_NS, None)
    recording.finish()
    assert len(read(recording.path).messages) == 1
