from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from hmcs_local.launcher import Launcher
from hmcs_local.log_lines import readable
from hmcs_local.stack import LocalStack

Describe = Callable[..., dict[str, Any]]
Eventually = Callable[[Callable[[], Any]], Any]

FAIL = "print('a'); print('the cause', flush=True); raise SystemExit({code})"


class Told(list[str]):
    """What the launcher says in its own name."""

    def __call__(self, who: str, what: str) -> None:
        self.append(what if who == "hmcs" else f"{who}: {what}")

    def having(self, words: str) -> list[str]:
        return [line for line in self if words in line]


class Clock:
    """A clock that goes when it is told to."""

    def __init__(self) -> None:
        self.now_s = 1e9

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def launch(
    write_compose: Callable[..., Path], tmp_path: Path
) -> Iterator[Callable[..., tuple[LocalStack, Launcher, Told, Clock]]]:
    """Bring up one service `a` and look after it; everything ends with the test."""
    stacks = []

    def start(described: dict[str, Any]) -> tuple[LocalStack, Launcher, Told, Clock]:
        path = write_compose(a=described)
        stack = LocalStack(path, services=["a"], folder=tmp_path)
        stacks.append(stack)
        stack.start_all()
        told, clock = Told(), Clock()
        return stack, Launcher(stack, told, clock), told, clock

    yield start
    for stack in stacks:
        stack.stop_all()


def test_an_unexpected_end_is_told_in_one_line_with_exit_code_and_last_words(
    launch: Callable[..., Any], service: Describe, eventually: Eventually
) -> None:
    stack, launcher, told, _ = launch(service(FAIL.format(code=3)))
    eventually(lambda: not stack.processes["a-1"].running)
    launcher.look()
    launcher.look()
    assert told == [
        "a-1: a",
        "a-1: the cause",
        "a-1 ended (exit code 3), not started again; its last words: the cause",
    ]


def test_a_kill_from_outside_is_told_by_its_signal(
    launch: Callable[..., Any], service: Describe
) -> None:
    stack, launcher, told, _ = launch(service())
    stack.processes["a-1"].kill()
    launcher.look()
    assert told.having("a-1 ended (killed by SIGKILL)")


def test_an_end_that_was_asked_for_is_no_failure(
    launch: Callable[..., Any], service: Describe
) -> None:
    stack, launcher, told, _ = launch(service(restart="always"))
    stack.kill("a", signal_number=signal.SIGTERM)
    launcher.look()
    assert told.having("a-1 stopped (killed by SIGTERM)")
    assert not told.having("again")


@pytest.mark.parametrize(
    ("restart", "code", "again"),
    [
        ("no", 1, False),
        ("on-failure", 0, False),
        ("on-failure", 1, True),
        ("on-failure", 2, False),
        ("always", 0, True),
        ("unless-stopped", 0, True),
        ("always", 2, False),
    ],
)
def test_it_is_started_again_as_compose_says_but_not_after_a_mistake_of_the_user(
    launch: Callable[..., Any],
    service: Describe,
    eventually: Eventually,
    restart: str,
    code: int,
    again: bool,
) -> None:
    stack, launcher, told, clock = launch(service(FAIL.format(code=code), restart=restart))
    first = stack.processes["a-1"]
    eventually(lambda: not first.running)
    launcher.look()
    assert stack.processes["a-1"] is first
    clock.now_s += 0.2
    launcher.look()
    assert (stack.processes["a-1"] is not first) == again
    assert bool(told.having("a-1 started again")) == again


def test_restarts_become_rarer_while_they_fail(
    launch: Callable[..., Any], service: Describe, eventually: Eventually
) -> None:
    stack, launcher, told, clock = launch(service(FAIL.format(code=1), restart="on-failure"))
    for _ in range(4):
        process = stack.processes["a-1"]
        process.started_s = clock.now_s
        eventually(lambda process=process: not process.running)
        launcher.look()
        clock.now_s += 3
        launcher.look()
    delays = [line.partition("again in ")[2].partition(" s")[0] for line in told.having("ended")]
    assert delays == ["0.1", "0.2", "0.4", "0.8"]


def test_a_log_line_of_a_service_is_shown_readable() -> None:
    line = '{"time": "t", "level": "warning", "process": "p/q", "event": "lost", "count": 3}'
    assert readable(line) == "warning lost  count=3"
    assert readable("plain text") == "plain text"
    assert readable("3") == "3"
    assert (
        readable('{"event": "e", "level": "error", "traceback": "T1\\nT2"}') == "error   e\nT1\nT2"
    )
