from __future__ import annotations

import contextlib
import json
import os
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from hmcs_local import control as controlling
from hmcs_local.control import LONGEST_BYTES, Control, ControlError, ControlServer, control_path
from hmcs_local.stack import LocalStack

Describe = Callable[..., dict[str, Any]]
Served = Callable[[LocalStack, Callable[[], Any]], Any]


@pytest.fixture(autouse=True)
def runtime_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@pytest.fixture
def stack(
    write_compose: Callable[..., Path], service: Describe, tmp_path: Path
) -> Iterator[LocalStack]:
    path = write_compose(a=service())
    with LocalStack(path, services=["a"], folder=tmp_path / "up") as stack:
        yield stack


def test_an_instance_can_be_started_and_stopped(stack: LocalStack, served: Served) -> None:
    control = Control(stack.folder)

    def command() -> None:
        assert control.start("a") == "a-2"
        assert control.owns("a-1")
        assert control.stop("a-1") == -15
        assert not control.owns("a-1")

    served(stack, command)
    assert [process.instance for process in stack.instances("a")] == ["a-2"]


def test_what_cannot_be_done_is_answered_and_the_server_goes_on(
    stack: LocalStack, served: Served
) -> None:
    control = Control(stack.folder)

    def command() -> None:
        with pytest.raises(ControlError, match="unknown service 'nobody'"):
            control.start("nobody")
        with pytest.raises(ControlError, match="'nobody' was not started here"):
            control.stop("nobody")
        with pytest.raises(ControlError, match="no program 'no-such-program'"):
            control.start("a", ["no-such-program"])
        with pytest.raises(ControlError, match="embedded null byte"):
            control.start("a", ["python", "a\0b"])
        assert control.owns("a-1")

    served(stack, command)


def test_without_an_up_in_the_folder_the_asker_gets_an_error(tmp_path: Path) -> None:
    with pytest.raises(ControlError, match="no `hmcs up` works in"):
        Control(tmp_path).owns("a-1")


def test_nobody_else_can_reach_it(stack: LocalStack) -> None:
    with ControlServer(stack):
        assert control_path(stack.folder).parent.stat().st_mode & 0o077 == 0


def test_a_folder_open_to_others_is_refused(stack: LocalStack) -> None:
    folder = control_path(stack.folder).parent
    folder.mkdir()
    folder.chmod(0o777)
    with pytest.raises(ControlError, match="can be used by others"):
        ControlServer(stack).__enter__()


def test_a_folder_of_another_user_is_refused(
    stack: LocalStack, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: here + 1)
    control_path(stack.folder).parent.mkdir(mode=0o700)
    with pytest.raises(ControlError, match="can be used by others"):
        ControlServer(stack).__enter__()


def test_a_link_in_the_place_of_the_folder_is_refused(stack: LocalStack, tmp_path: Path) -> None:
    (tmp_path / "private").mkdir(mode=0o700)
    control_path(stack.folder).parent.symlink_to(tmp_path / "private")
    with pytest.raises(ControlError, match="can be used by others"):
        ControlServer(stack).__enter__()


def test_who_asks_looks_whose_folder_it_is_before_it_says_anything(stack: LocalStack) -> None:
    path = control_path(stack.folder)
    path.parent.mkdir(mode=0o700)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(path))
        listening.listen()
        path.parent.chmod(0o755)
        with pytest.raises(ControlError, match="can be used by others"):
            Control(stack.folder).owns("a-1")
        listening.settimeout(0.0)
        with pytest.raises(BlockingIOError):
            listening.accept()


def said(stack: LocalStack, question: bytes) -> bytes:
    """Return what is answered to anything at all."""
    with socket.socket(socket.AF_UNIX) as connection, contextlib.suppress(OSError):
        connection.settimeout(30)
        connection.connect(str(control_path(stack.folder)))
        connection.sendall(question)
        return connection.recv(LONGEST_BYTES)
    return b""


@pytest.mark.parametrize(
    "question",
    [
        b"",
        b"\n",
        b"\xff\xfe\x00\n",
        b"{\n",
        b"7\n",
        b"null\n",
        b"[]\n",
        b"{}\n",
        b"[" * 60_000 + b"\n",
        b'{"runs": ["a-1"]}\n',
        b'{"runs": {"a": 1}}\n',
        b'{"stop": null}\n',
        b'{"stop": 1}\n',
        b'{"start": "a", "command": "ls"}\n',
        b'{"start": "a", "command": []}\n',
        b'{"start": "a", "command": [7]}\n',
        b'{"start": "a", "command": {"0": "ls"}}\n',
        b'{"start": "a", "stop": "a-1"}\n',
        b'{"start": "router"}\n',
        b'{"start": "\\ud800"}\n',
        b'{"stop": "a-1"' + b" " * LONGEST_BYTES + b"}\n",
        b'{"stop": "a-1"}',
        b'{"runs": "a-1"}\n{"stop": "a-1"}\n',
    ],
    ids=lambda question: repr(question[:24]),
)
def test_garbage_changes_nothing_and_is_survived(
    stack: LocalStack, served: Served, monkeypatch: pytest.MonkeyPatch, question: bytes
) -> None:
    monkeypatch.setattr(controlling, "_REQUEST_TIMEOUT_S", 0.2)

    def ask() -> None:
        answer = said(stack, question)
        assert not answer or list(json.loads(answer)) == ["error"]
        assert Control(stack.folder).owns("a-1")

    served(stack, ask)
    assert [process.instance for process in stack.instances("a")] == ["a-1"]


def test_who_asks_letter_by_letter_holds_nobody_up(
    stack: LocalStack, served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(controlling, "_REQUEST_TIMEOUT_S", 0.2)

    def drip() -> None:
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(str(control_path(stack.folder)))
            deadline_s = time.monotonic() + 30
            with contextlib.suppress(ConnectionError):
                while True:
                    assert time.monotonic() < deadline_s, "it is still listened to"
                    connection.sendall(b" ")
                    time.sleep(0.02)
        assert Control(stack.folder).owns("a-1")

    served(stack, drip)


def test_another_user_is_not_answered(stack: LocalStack, served: Served) -> None:
    path, here = control_path(stack.folder), os.getuid()

    def stop_a() -> bytes:
        with socket.socket(socket.AF_UNIX) as connection, contextlib.suppress(ConnectionError):
            connection.settimeout(30)
            connection.connect(str(path))
            connection.sendall(b'{"stop": "a-1"}\n')
            return connection.recv(100)
        return b""

    def ask() -> None:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(os, "getuid", lambda: here + 1)
            assert stop_a() == b""

    served(stack, ask)
    assert stack.instances("a")


def test_a_socket_left_by_one_that_was_killed_is_no_hindrance(stack: LocalStack) -> None:
    path = control_path(stack.folder)
    path.parent.mkdir(mode=0o700)
    path.touch()
    with ControlServer(stack):
        assert path.is_socket()
