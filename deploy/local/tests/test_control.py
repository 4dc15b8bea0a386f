from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from hmcs_local.control import Control, ControlError, ControlServer, control_path
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
        with pytest.raises(ControlError, match="no service 'nobody'"):
            control.start("nobody")
        with pytest.raises(ControlError, match="not understood"):
            control.stop("nobody")
        assert control.owns("a-1")

    served(stack, command)


def test_without_an_up_in_the_folder_the_asker_is_told(tmp_path: Path) -> None:
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


def test_a_socket_left_by_one_that_was_killed_is_no_hindrance(stack: LocalStack) -> None:
    path = control_path(stack.folder)
    path.parent.mkdir(mode=0o700)
    path.touch()
    with ControlServer(stack):
        assert path.is_socket()
