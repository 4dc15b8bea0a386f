"""The loop of a process: messages in order of arrival, timers when they are due, one thread."""

from __future__ import annotations

import time
from collections.abc import Callable

from hmcs.bus.counters import Counters
from hmcs.bus.mailbox import Mailbox, Work
from hmcs.bus.timers import NS_PER_S, Timers


class Loop:
    """Takes from `mailbox` and `timers` and counts what it handles in `counters`."""

    def __init__(
        self, mailbox: Mailbox, timers: Timers, counters: Counters, stopping: Callable[[], bool]
    ) -> None:
        self._mailbox = mailbox
        self._timers = timers
        self._counters = counters
        self._stopping = stopping

    def pump(self, timeout_s: float) -> int:
        """Handle what is pending; wait at most `timeout_s` for something to do.

        Returns how many things were handled. An exception of a handler leaves `pump`; whatever
        else is pending stays for the next call.
        """
        deadline_ns = time.monotonic_ns() + round(timeout_s * NS_PER_S)
        before = self._counters.handled
        first = self._wait_for_work(deadline_ns)
        if first is not None:
            self._do(first)
            # Only what is pending now, so that a steady stream cannot keep the caller here.
            for _ in range(self._mailbox.pending()):
                if self._stopping():
                    break
                while (timer := self._timers.pop_due(time.monotonic_ns())) is not None:
                    self._do(timer.handler)
                work = self._mailbox.take(0)
                if work is not None:
                    self._do(work)
        return self._counters.handled - before

    def _wait_for_work(self, deadline_ns: int) -> Work | None:
        while not self._stopping():
            now_ns = time.monotonic_ns()
            timer = self._timers.pop_due(now_ns)
            if timer is not None:
                return timer.handler
            due_ns = self._timers.next_due_ns()
            until_ns = deadline_ns if due_ns is None else min(deadline_ns, due_ns)
            work = self._mailbox.take((until_ns - now_ns) / NS_PER_S)
            if work is not None:
                return work
            if now_ns >= deadline_ns:
                break
        return None

    def _do(self, work: Work) -> None:
        self._counters.handled += 1
        work()
