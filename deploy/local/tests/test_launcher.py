from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from hmcs_local import processes
from hmcs_local.launcher import Launcher
from hmcs_local.log_lines import readable
from hmcs_local.stack import LocalStack, StackError

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
    """A clock that a test moves."""

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
        reported, clock = Told(), Clock()
        return stack, Launcher(stack, reported, clock), reported, clock

    yield start
    for stack in stacks:
        stack.stop_all()


def test_an_unexpected_end_is_reported_in_one_line_with_exit_code_and_last_words(
    launch: Callable[..., Any], service: Describe, eventually: Eventually
) -> None:
    stack, launcher, reported, _ = launch(service(FAIL.format(code=3)))
    eventually(lambda: not stack.processes["a-1"].running)
    launcher.look()
    launcher.look()
    assert reported == [
        "a-1: a",
        "a-1: the cause",
        "a-1 ended (exit code 3), not started again; its last words: the cause",
    ]


def test_a_kill_from_outside_is_reported_by_its_signal(
    launch: Callable[..., Any], service: Describe
) -> None:
    stack, launcher, reported, _ = launch(service())
    stack.processes["a-1"].kill()
    launcher.look()
    assert reported.having("a-1 ended (killed by SIGKILL)")


def test_an_end_that_was_asked_for_is_no_failure(
    launch: Callable[..., Any], service: Describe
) -> None:
    stack, launcher, reported, _ = launch(service(restart="always"))
    stack.kill("a", signal_number=signal.SIGTERM)
    launcher.look()
    assert reported.having("a-1 stopped (killed by SIGTERM)")
    assert not reported.having("again")


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
    stack, launcher, reported, clock = launch(service(FAIL.format(code=code), restart=restart))
    first = stack.processes["a-1"]
    eventually(lambda: not first.running)
    launcher.look()
    assert stack.processes["a-1"] is first
    clock.now_s += 0.2
    launcher.look()
    assert (stack.processes["a-1"] is not first) == again
    assert bool(reported.having("a-1 started again")) == again


def test_restarts_become_rarer_while_they_fail(
    launch: Callable[..., Any], service: Describe, eventually: Eventually
) -> None:
    stack, launcher, reported, clock = launch(service(FAIL.format(code=1), restart="on-failure"))
    for _ in range(4):
        process = stack.processes["a-1"]
        process.started_s = clock.now_s
        eventually(lambda process=process: not process.running)
        launcher.look()
        clock.now_s += 3
        launcher.look()
    delays = [
        line.partition("again in ")[2].partition(" s")[0] for line in reported.having("ended")
    ]
    assert delays == ["0.1", "0.2", "0.4", "0.8"]


def ended_again(
    stack: LocalStack, launcher: Launcher, clock: Clock, eventually: Eventually
) -> None:
    """Let `a-1`, which fails at once, end and be judged, and its next start fall due."""
    process = stack.processes["a-1"]
    process.started_s = clock.now_s
    eventually(lambda: not process.running)
    launcher.look()
    clock.now_s += 3


def test_however_often_it_fails_it_is_started_again_after_ten_seconds_at_most(
    launch: Callable[..., Any], service: Describe, eventually: Eventually
) -> None:
    stack, launcher, _told, clock = launch(service(FAIL.format(code=1), restart="always"))
    process = stack.processes["a-1"]
    eventually(lambda: not process.running)
    delays = {launcher._restart_delay_s(process, 1) for _ in range(3000)}
    process.started_s = clock.now_s
    delays |= {launcher._restart_delay_s(process, 1) for _ in range(3000)}
    assert max(delays) == 10.0


def test_one_that_cannot_be_started_again_is_tried_until_it_can(
    launch: Callable[..., Any],
    service: Describe,
    eventually: Eventually,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stack, launcher, reported, clock = launch(service(FAIL.format(code=1), restart="on-failure"))
    first = stack.processes["a-1"]
    ended_again(stack, launcher, clock, eventually)
    with monkeypatch.context() as patch:

        def fail(_: str) -> None:
            raise BlockingIOError(11, "Resource temporarily unavailable")

        patch.setattr(stack, "restart", fail)
        for _ in range(5):
            launcher.look()
            clock.now_s += 20
    assert stack.processes["a-1"] is first
    assert len(reported.having("a-1 cannot be started")) == 5
    launcher.look()
    assert stack.processes["a-1"] is not first


def test_one_that_its_user_stops_before_its_next_start_stays_stopped(
    launch: Callable[..., Any], service: Describe, eventually: Eventually
) -> None:
    stack, launcher, _told, clock = launch(service(FAIL.format(code=1), restart="always"))
    first = stack.processes["a-1"]
    ended_again(stack, launcher, clock, eventually)
    first.stop()
    launcher.look()
    assert stack.processes["a-1"] is first


def test_an_end_is_judged_though_another_process_had_the_same_pid(
    launch: Callable[..., Any],
    service: Describe,
    eventually: Eventually,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(processes.StackProcess, "pid", 7)
    stack, launcher, reported, clock = launch(service(FAIL.format(code=1), restart="always"))
    for _ in range(3):
        ended_again(stack, launcher, clock, eventually)
        launcher.look()
    assert len(reported.having("a-1 ended")) == 3


def test_what_goes_wrong_in_judging_one_process_is_said_once_and_made_good(
    launch: Callable[..., Any],
    service: Describe,
    eventually: Eventually,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stack, launcher, reported, _clock = launch(service(FAIL.format(code=1), restart="always"))
    process = stack.processes["a-1"]
    eventually(lambda: not process.running)
    with monkeypatch.context() as patch:

        def fail() -> None:
            raise StackError("cannot be judged")

        patch.setattr(process, "last_lines", fail)
        for _ in range(3):
            launcher.look()
    assert len(reported.having("a-1: looking after it failed: StackError: cannot be judged")) == 1
    launcher.look()
    assert reported.having("a-1 ended (exit code 1), starting again")


@pytest.mark.parametrize(
    "error", [OSError(28, "No space left"), UnicodeEncodeError("", "", 0, 1, "")]
)
def test_a_stack_goes_on_where_nobody_can_be_notified(
    launch: Callable[..., Any], service: Describe, eventually: Eventually, error: Exception
) -> None:
    stack, _, _, clock = launch(service(FAIL.format(code=1), restart="always"))

    def nobody_hears(_who: str, _what: str) -> None:
        raise error

    launcher = Launcher(stack, nobody_hears, clock)
    first = stack.processes["a-1"]
    ended_again(stack, launcher, clock, eventually)
    launcher.look()
    assert stack.processes["a-1"] is not first


def test_a_log_that_was_removed_ends_nothing(
    launch: Callable[..., Any], service: Describe, eventually: Eventually
) -> None:
    stack, launcher, reported, clock = launch(service(FAIL.format(code=1), restart="always"))
    first = stack.processes["a-1"]
    first.log_path.unlink()
    ended_again(stack, launcher, clock, eventually)
    assert reported.having("a-1 ended (exit code 1), starting again")
    launcher.look()
    assert stack.processes["a-1"] is not first


FLOODS = "import sys; sys.stdout.write({text!r} * {times}); sys.stdout.flush(); print('the end')"


@pytest.mark.parametrize("text", ["a line of a log\n", "x"], ids=["lines", "one endless line"])
def test_of_a_flood_of_lines_the_end_is_shown_and_what_is_left_out_is_said(
    launch: Callable[..., Any], service: Describe, eventually: Eventually, text: str
) -> None:
    times = 3 * processes.SHOWN_AT_ONCE_BYTES
    stack, launcher, reported, _ = launch(service(FLOODS.format(text=text, times=times)))
    eventually(lambda: not stack.processes["a-1"].running)
    launcher.look()
    shown = reported.having("a-1: ")
    assert "bytes are left out here, see" in shown[0]
    assert len("".join(shown)) < 4 * processes.SHOWN_AT_ONCE_BYTES
    assert shown[-1].endswith("the end") or len(text) == 1


def test_a_line_that_does_not_end_is_shown_in_pieces(
    launch: Callable[..., Any], service: Describe, eventually: Eventually
) -> None:
    size = processes.SHOWN_AT_ONCE_BYTES
    script = f"import time; print('x' * {size}, end='', flush=True); time.sleep(600)"
    stack, launcher, reported, _ = launch(service(script))
    process = stack.processes["a-1"]
    eventually(lambda: process.log_path.stat().st_size == size)
    launcher.look()
    assert reported.having("xxx")
    launcher.look()
    assert len(reported) == 1


def test_a_log_that_grows_without_end_is_begun_anew(
    launch: Callable[..., Any],
    service: Describe,
    eventually: Eventually,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(processes, "LARGEST_LOG_BYTES", 10_000)
    script = (
        "import time\nfor k in range(10**9): print(f'line {k:9}', flush=True); time.sleep(1e-4)"
    )
    stack, launcher, reported, _ = launch(service(script))
    log = stack.processes["a-1"].log_path
    older = log.with_name(f"{log.name}.1")

    def look_twice() -> bool:
        launcher.look()
        return len(reported.having("its log is begun anew")) >= 2

    eventually(look_twice)
    assert older.stat().st_size > 10_000
    assert log.stat().st_size < older.stat().st_size + 10_000
    numbers = [int(line.rpartition(" ")[2]) for line in reported.having("a-1: line")]
    assert numbers == sorted(set(numbers))
    count = len(numbers)
    eventually(lambda: launcher.look() or len(reported.having("a-1: line")) > count)


def test_a_real_time_signal_has_a_number_alone(
    launch: Callable[..., Any], service: Describe, eventually: Eventually
) -> None:
    stack, launcher, reported, _ = launch(service("import os; os.kill(os.getpid(), 40)"))
    eventually(lambda: not stack.processes["a-1"].running)
    launcher.look()
    assert reported.having("a-1 ended (killed by signal 40)")


@pytest.mark.parametrize(
    ("line", "shown"),
    [
        ("\x1b[2J\x1b]0;title\x07", "\\x1b[2J\\x1b]0;title\\x07"),
        (
            '{"event": "e", "key": "robot/\\u001b[2J\\u202e"}',
            "        e  key=robot/\\x1b[2J\\u202e",
        ),
        ('{"event": "e", "level": ["x"]}', "['x']   e"),
        ('{"event": "e", "traceback": "T\\n  in \\u001b[2J"}', "        e\nT\n  in \\x1b[2J"),
        ('{"event": null, "traceback": 7}', "        None\n7"),
    ],
)
def test_what_a_log_line_quotes_cannot_move_the_cursor(line: str, shown: str) -> None:
    assert readable(line) == shown


def test_a_line_of_brackets_is_a_line() -> None:
    assert readable("[" * 100_000).startswith("[[[")


def test_a_log_line_of_a_service_is_shown_readable() -> None:
    line = '{"time": "t", "level": "warning", "process": "p/q", "event": "lost", "count": 3}'
    assert readable(line) == "warning lost  count=3"
    assert readable("plain text") == "plain text"
    assert readable("3") == "3"
    assert (
        readable('{"event": "e", "level": "error", "traceback": "T1\\nT2"}') == "error   e\nT1\nT2"
    )
