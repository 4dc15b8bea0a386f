"""Where Zenoh's threads leave what arrived, for the one thread of a process that handles it.

Leaving something never waits for the handling: a callback that did would stall every other
subscription of the session.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import NamedTuple

Work = Callable[[], None]

KEEP_ALL_BOUND = 10_000
"""Messages a subscription that gets every one may have pending; more are lost, and so counted."""
KEEP_ALL_BYTES = 64 * 1024 * 1024
"""Their bytes together: a flood of large messages must not fill the memory of a process."""
SENDER_SHARE = 4
"""One sender may take the n-th part of that room, so that its flood leaves room for the others."""
LISTENING_BOUND = 50_000
"""Messages a listener may have waiting; more are lost, and so counted."""
LISTENING_BYTES = 64 * 1024 * 1024
"""Their bytes together."""
MOST_SENDERS = 256
"""Senders whose newest message may wait; a flood of made-up ones is cut off there."""


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
    size_bytes: int = 0
    """Of the payload; of one that was too large to be taken in only this is known."""


class KeepLast:
    """Keeps the newest message of each key and sender until it is handled.

    Of each sender: where two write on one key, it is for the service to say whom it hears.
    """

    def __init__(
        self,
        mailbox: Mailbox,
        handle: Callable[[Arrival], None],
        overflowed: Callable[[], None] = lambda: None,
        most_senders: int = MOST_SENDERS,
    ) -> None:
        self._mailbox = mailbox
        self._handle = handle
        self._overflowed = overflowed
        self._most_senders = most_senders
        self._slots: dict[tuple[str, bytes], Arrival] = {}
        self._full = False
        self._lock = threading.Lock()

    def arrive(self, arrival: Arrival) -> None:
        """Take a message in; from any thread."""
        slot = (arrival.key, arrival.sender)
        with self._lock:
            waiting = self._slots.get(slot)
            if waiting is not None:
                self._slots[slot] = arrival._replace(overwritten=waiting.overwritten + 1)
                return
            full, was_full = len(self._slots) >= self._most_senders, self._full
            self._full = full
            if not full:
                self._slots[slot] = arrival
        if not full:
            self._mailbox.put(lambda: self._handle_newest(slot))
        elif not was_full:
            self._mailbox.put(self._overflowed)

    def _handle_newest(self, slot: tuple[str, bytes]) -> None:
        with self._lock:
            arrival = self._slots.pop(slot)
        self._handle(arrival)


class KeepAll:
    """Keeps every message, in order, up to a bound in number and in bytes."""

    def __init__(
        self,
        mailbox: Mailbox,
        handle: Callable[[Arrival], None],
        overflowed: Callable[[], None],
        bound: int = KEEP_ALL_BOUND,
        bound_bytes: int = KEEP_ALL_BYTES,
    ) -> None:
        self._mailbox = mailbox
        self._handle = handle
        self._overflowed = overflowed
        self._all = _Room(bound, bound_bytes)
        self._share = _Room(-(-bound // SENDER_SHARE), -(-bound_bytes // SENDER_SHARE))
        self._of_sender: dict[bytes, _Room] = {}
        self._full = False
        self._lock = threading.Lock()

    def arrive(self, arrival: Arrival) -> None:
        """Take a message in; from any thread."""
        size = len(arrival.payload)
        with self._lock:
            own = self._of_sender.get(arrival.sender, self._share)
            fits, was_full = self._all.fits(size) and own.fits(size), self._full
            self._full = not fits
            if fits:
                self._all = self._all.less(1, size)
                self._of_sender[arrival.sender] = own.less(1, size)
        if fits:
            self._mailbox.put(lambda: self._handle_next(arrival))
        elif not was_full:
            self._mailbox.put(self._overflowed)

    def _handle_next(self, arrival: Arrival) -> None:
        size = len(arrival.payload)
        with self._lock:
            self._all = self._all.less(-1, -size)
            own = self._of_sender[arrival.sender].less(-1, -size)
            if own == self._share:
                del self._of_sender[arrival.sender]
            else:
                self._of_sender[arrival.sender] = own
        self._handle(arrival)


class Listening:
    """Keeps whatever arrives, in order, until all of it is handed on together."""

    def __init__(self, handle: Callable[[Arrival], None], overflowed: Callable[[], None]) -> None:
        self._handle = handle
        self._overflowed = overflowed
        self._waiting: deque[Arrival] = deque()
        self._room = _Room(LISTENING_BOUND, LISTENING_BYTES)
        self._full = False
        self._lock = threading.Lock()

    def arrive(self, arrival: Arrival) -> None:
        """Take a message in; from any thread."""
        size = len(arrival.payload)
        with self._lock:
            if self._room.fits(size):
                self._room = self._room.less(1, size)
                self._waiting.append(arrival)
            else:
                self._full = True

    def hand_on(self) -> None:
        """Hand on all that waits now."""
        with self._lock:
            full, self._full = self._full, False
            waiting, self._waiting = self._waiting, deque()
            self._room = _Room(LISTENING_BOUND, LISTENING_BYTES)
        if full:
            self._overflowed()
        for arrival in waiting:
            self._handle(arrival)


class _Room(NamedTuple):
    """What may still wait."""

    messages: int
    size_bytes: int

    def fits(self, size_bytes: int) -> bool:
        return self.messages > 0 and self.size_bytes >= size_bytes

    def less(self, messages: int, size_bytes: int) -> _Room:
        return _Room(self.messages - messages, self.size_bytes - size_bytes)
