"""Files are written whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from hmcs.whole_files import written_whole


def test_a_file_takes_its_place_once_it_is_whole(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("before")
    with written_whole(target) as unfinished:
        unfinished.write_text("after")
        assert target.read_text() == "before"
    assert target.read_text() == "after"
    assert list(tmp_path.iterdir()) == [target]


def test_where_writing_fails_nothing_is_left_and_nothing_lost(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("before")

    def interrupted() -> None:
        with written_whole(target) as unfinished:
            unfinished.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert target.read_text() == "before"
    assert list(tmp_path.iterdir()) == [target]
