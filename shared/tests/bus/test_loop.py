"""Messages and timers of one thread, and where it stops."""

from __future__ import annotations

from hmcs.bus.counters import Counters
from hmcs.bus.loop import Loop
from hmcs.bus.mailbox import Mailbox
from hmcs.bus.timers import Timer, Timers


class Process:
    """A loop with a clock that stands, and what it handled."""

    def __init__(self) -> None:
        self.mailbox, self.timers, self.handled = Mailbox(), Timers(), list[str]()
        self.stopped = False
        self.loop = Loop(
            self.mailbox, self.timers, Counters(), lambda: self.stopped, clock_ns=lambda: 0
        )

    def put(self, *names: str) -> None:
        for name in names:
            self.mailbox.put(lambda name=name: self.handled.append(name))

    def stop(self) -> None:
        self.handled.append("stop")
        self.stopped = True


def test_who_is_asked_to_stop_handles_nothing_that_came_after() -> None:
    process = Process()
    process.put("first")
    process.mailbox.put(process.stop)
    process.put("second", "third")
    assert process.loop.pump(0.0) == 2
    assert process.loop.pump(60.0) == 0
    assert process.handled == ["first", "stop"]


def test_what_comes_while_it_pumps_is_left_for_the_next_time() -> None:
    process = Process()
    process.put("first")
    process.mailbox.put(lambda: process.put("third"))
    process.put("second")
    assert process.loop.pump(0.0) == 3
    assert process.handled == ["first", "second"]
    assert process.loop.pump(0.0) == 1
    assert process.handled == ["first", "second", "third"]


def test_timers_that_are_always_due_and_messages_take_turns() -> None:
    process = Process()

    def due() -> None:
        process.handled.append("timer")
        process.timers.add(0, Timer(due, None))

    process.timers.add(0, Timer(due, None))
    process.put("first", "second")
    for _ in range(4):
        process.loop.pump(0.0)
    assert process.handled[:4] == ["timer", "first", "timer", "second"]
