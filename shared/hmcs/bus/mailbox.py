"""Where Zenoh's threads leave what arrived, for the one thread of a process that handles it.

Leaving something never waits for the handling: a callback that did would stall every other
subscription of the session.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import NamedTuple

Work = Callable[[], None]

EVERY_ONE_BOUND = 10_000
"""Messages a subscription that gets every one may have pending; more are lost, and so counted."""


class Mailbox:
    """Pending work in order of arrival. All methods but `take` may be called from any thread,
    and from a signal handler.
    """

    def __init__(self) -> None:
        # SimpleQueue.put is reentrant, so that a signal handler may wake the thread it interrupted.
        self._queue: SimpleQueue[Work | None] = SimpleQueue()

    def put(self, work: Work) -> None:
        """Leave work."""
        self._queue.put(work)

    def wake(self) -> None:
        """Let a waiting `take` return None at once."""
        self._queue.put(None)

    def pending(self) -> int:
        """Return how much is pending now."""
        return self._queue.qsize()

    def take(self, timeout_s: float) -> Work | None:
        """Return the oldest work, waiting at most `timeout_s` for it, or None."""
        try:
            if timeout_s <= 0:
                return self._queue.get_nowait()
            return self._queue.get(timeout=timeout_s)
        except Empty:
            return None


class Arrival(NamedTuple):
    """One message as it arrived."""

    key: str
    payload: bytes
    received_ns: int
    """By the local monotonic clock."""
    sender: bytes = b""
    """Boot of its sender as it stands beside the message, readable without decoding it."""
    overwritten: int = 0
    """How many older ones of its key and sender gave way to it while they waited."""


class NewestWins:
    """Keeps the newest message of each key and sender until it is handled.

    Of each sender: where two write on one key, it is for the service to say whom it hears.
    """

    def __init__(self, mailbox: Mailbox, handle: Callable[[Arrival], None]) -> None:
        self._mailbox = mailbox
        self._handle = handle
        self._slots: dict[tuple[str, bytes], Arrival] = {}
        self._lock = threading.Lock()

    def arrive(self, arrival: Arrival) -> None:
        """Take a message in; from any thread."""
        slot = (arrival.key, arrival.sender)
        with self._lock:
            waiting = self._slots.get(slot)
            if waiting is not None:
                arrival = arrival._replace(overwritten=waiting.overwritten + 1)
            self._slots[slot] = arrival
        if waiting is None:
            self._mailbox.put(lambda: self._handle_newest(slot))

    def _handle_newest(self, slot: tuple[str, bytes]) -> None:
        with self._lock:
            arrival = self._slots.pop(slot)
        self._handle(arrival)


class EveryOne:
    """Keeps every message, in order, up to a bound."""

    def __init__(
        self,
        mailbox: Mailbox,
        handle: Callable[[Arrival], None],
        overflowed: Callable[[], None],
        bound: int = EVERY_ONE_BOUND,
    ) -> None:
        self._mailbox = mailbox
        self._handle = handle
        self._overflowed = overflowed
        self._room = threading.BoundedSemaphore(bound)
        self._full = False

    def arrive(self, arrival: Arrival) -> None:
        """Take a message in; from any thread."""
        if self._room.acquire(blocking=False):
            self._full = False
            self._mailbox.put(lambda: self._handle_next(arrival))
        elif not self._full:
            self._full = True
            self._mailbox.put(self._overflowed)

    def _handle_next(self, arrival: Arrival) -> None:
        self._room.release()
        self._handle(arrival)
