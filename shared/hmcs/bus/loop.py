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
        self,
        mailbox: Mailbox,
        timers: Timers,
        counters: Counters,
        stopping: Callable[[], bool],
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._mailbox = mailbox
        self._timers = timers
        self._counters = counters
        self._stopping = stopping
        self._clock_ns = clock_ns
        self._timer_next = True

    def pump(self, timeout_s: float) -> int:
        """Handle what is pending; wait at most `timeout_s` for something to do.

        Returns how many things were handled. An exception of a handler leaves `pump`; whatever
        else is pending stays for the next call.
        """
        deadline_ns = self._clock_ns() + round(timeout_s * NS_PER_S)
        before = self._counters.handled
        first = self._wait_for_work(deadline_ns)
        if first is not None:
            self._do(first)
            # Only as much as is pending now, so that a steady stream cannot keep the caller here.
            for _ in range(self._mailbox.pending()):
                if self._stopping():
                    break
                work = self._pending()
                if work is None:
                    break
                self._do(work)
        return self._counters.handled - before

    def _wait_for_work(self, deadline_ns: int) -> Work | None:
        while not self._stopping():
            work = self._pending()
            if work is not None:
                return work
            now_ns = self._clock_ns()
            if now_ns >= deadline_ns:
                break
            due_ns = self._timers.next_due_ns()
            until_ns = deadline_ns if due_ns is None else min(deadline_ns, due_ns)
            work = self._mailbox.take((until_ns - now_ns) / NS_PER_S)
            if work is not None:
                return work
        return None

    def _pending(self) -> Work | None:
        """Return what is to be done now, if anything.

        Timers and messages take turns: neither a timer that takes longer than its period nor a
        flood of messages can keep the other waiting.
        """
        for timer_first in (self._timer_next, not self._timer_next):
            work = self._due_timer() if timer_first else self._mailbox.take(0)
            if work is not None:
                self._timer_next = not timer_first
                return work
        return None

    def _due_timer(self) -> Work | None:
        timer = self._timers.pop_due(self._clock_ns())
        return None if timer is None else timer.handler

    def _do(self, work: Work) -> None:
        self._counters.handled += 1
        work()
