"""Timers of the one thread that pumps."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable

NS_PER_S = 1_000_000_000


class Timer:
    """Something to be done at a time; `cancel` calls it off."""

    def __init__(self, handler: Callable[[], None], period_ns: int | None) -> None:
        self.handler = handler
        self.period_ns = period_ns
        self.cancelled = False

    def cancel(self) -> None:
        """Call it off; allowed any time, also in the handler itself."""
        self.cancelled = True


class Timers:
    """Timers by the time they are due, ns of the monotonic clock."""

    def __init__(self) -> None:
        self._due: list[tuple[int, int, Timer]] = []
        self._order = itertools.count()

    def add(self, due_ns: int, timer: Timer) -> Timer:
        """Add a timer."""
        heapq.heappush(self._due, (due_ns, next(self._order), timer))
        return timer

    def next_due_ns(self) -> int | None:
        """Return when the next one is due; None where there is none."""
        while self._due and self._due[0][2].cancelled:
            heapq.heappop(self._due)
        return self._due[0][0] if self._due else None

    def pop_due(self, now_ns: int) -> Timer | None:
        """Return a timer that is due, or None.

        A periodic one is put back on its grid, past any ticks that were missed: the rate neither
        drifts nor catches up.
        """
        due_ns = self.next_due_ns()
        if due_ns is None or due_ns > now_ns:
            return None
        _, _, timer = heapq.heappop(self._due)
        if timer.period_ns is not None:
            missed = (now_ns - due_ns) // timer.period_ns
            self.add(due_ns + (missed + 1) * timer.period_ns, timer)
        return timer
