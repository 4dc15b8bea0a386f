"""Only ordinary files are read, and no more of them than was agreed on."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from hmcs.bounded_files import UnreadableFileError, read_bounded
from hmcs.errors import UserError


def test_a_file_is_read_up_to_the_bound_and_not_beyond(tmp_path: Path) -> None:
    file = tmp_path / "f"
    content = bytes(range(256)) * 9_000
    file.write_bytes(content)
    assert read_bounded(file, len(content)) == content
    with pytest.raises(UnreadableFileError, match="larger than 2,303,999 bytes"):
        read_bounded(file, len(content) - 1)


def test_an_empty_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "f").touch()
    assert read_bounded(tmp_path / "f", 0) == b""


def test_a_link_is_read_as_what_it_leads_to(tmp_path: Path) -> None:
    (tmp_path / "f").write_bytes(b"x")
    (tmp_path / "link").symlink_to("f")
    assert read_bounded(tmp_path / "link", 1) == b"x"


def test_what_is_no_ordinary_file_is_refused_at_once(tmp_path: Path) -> None:
    pipe, circle, named = tmp_path / "pipe", tmp_path / "circle", tmp_path / "socket"
    os.mkfifo(pipe)
    circle.symlink_to("circle")
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(named))
        for place, says in {
            tmp_path: "a folder",
            pipe: "a pipe",
            named: "a pipe, socket",
            Path("/dev/zero"): "device",
            circle: "levels of symbolic links",
            tmp_path / "none": "no such file",
            pipe / "none": "no such file",
            Path("x" * 5_000): "too long",
        }.items():
            with pytest.raises(UnreadableFileError, match=says) as caught:
                read_bounded(place, 10)
            assert isinstance(caught.value, UserError)
            assert caught.value.what in str(caught.value)


def test_a_name_with_a_null_byte_is_refused() -> None:
    with pytest.raises(UnreadableFileError, match="cannot be a path"):
        read_bounded("a\0b", 10)


def test_a_pipe_that_takes_the_files_place_meanwhile_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ordinary, pipe = tmp_path / "f", tmp_path / "pipe"
    ordinary.touch()
    os.mkfifo(pipe)
    before = ordinary.stat()
    monkeypatch.setattr(Path, "stat", lambda _: before)
    with pytest.raises(UnreadableFileError, match="a pipe"):
        read_bounded(pipe, 10)
