"""What pages do, until it is taken: in order, and bounded whatever a page sends.

A page that floods harms nobody but itself. Of its positions and signs of life only the newest
count; of everything else so much is kept as a hand could do; what ends a motion always comes
through, since said twice in a row it says nothing more.
"""

from __future__ import annotations

import threading
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

from hmcs_console.operating.handles import Alive, Event, Gone, LetGo, Moved, Stopped

BOUND = 50
"""So many things of one page are kept between two takes; a hand does a few."""

Press = Callable[[], None]
"""What is to be done for a page, one of whose buttons was pressed."""

_presser: ContextVar[int | None] = ContextVar("presser", default=None)


class PageEvents(NamedTuple):
    """What pages did since the last time."""

    events: tuple[Event | Press, ...]
    """Oldest first."""
    dropped: Mapping[int | None, int]
    """How many things were too many, by page; None for what no page has put its name to."""


class Inbox:
    """Keeps what pages do; `put` is called on any thread, `take` on one."""

    def __init__(self, bound: int = BOUND) -> None:
        self._bound = bound
        self._lock = threading.Lock()
        self._clear()

    def put(self, event: Event | Press) -> None:
        """Put down what a page did; a press is of the page of `pressed_by`."""
        client = _client_of(event)
        with self._lock:
            match event:
                case Moved() | Alive():
                    self._newest(client, event)
                case LetGo() | Gone() | Stopped():
                    self._end(client, event)
                case _ if self._counts[client] < self._bound:
                    self._counts[client] += 1
                    self._ended[client].clear()
                    self._ended[None].clear()
                    self._bar(client, event)
                case _:
                    self._dropped[client] += 1

    def take(self) -> PageEvents:
        """Take what there is."""
        with self._lock:
            taken = PageEvents(tuple(self._events), dict(self._dropped))
            self._clear()
        return taken

    def _clear(self) -> None:
        self._events: list[Event | Press] = []
        self._counts: Counter[int | None] = Counter()
        self._dropped: Counter[int | None] = Counter()
        self._slots: dict[int | None, dict[type, int]] = {}
        """Where a page's newest position and sign of life stand, for a newer one to replace."""
        self._ended: defaultdict[int | None, set[type]] = defaultdict(set)
        """How a page has ended its motion, and done nothing since; None for everybody's."""

    def _newest(self, client: int | None, event: Event) -> None:
        slots = self._slots.setdefault(client, {})
        if type(event) in slots:
            self._events[slots[type(event)]] = event
        else:
            slots[type(event)] = len(self._events)
            self._events.append(event)

    def _end(self, client: int | None, event: Event) -> None:
        if type(event) not in self._ended[client]:
            self._ended[client].add(type(event))
            self._bar(client, event)

    def _bar(self, client: int | None, event: Event | Press) -> None:
        """Add what no position of the same page may come to stand before."""
        if isinstance(event, Stopped):
            self._slots.clear()
        self._slots.pop(client, None)
        self._events.append(event)


@contextmanager
def pressed_by(client: int | None) -> Iterator[None]:
    """Put a page's name to the presses that are put down meanwhile, on this thread or task."""
    token = _presser.set(client)
    try:
        yield
    finally:
        _presser.reset(token)


def _client_of(event: Event | Press) -> int | None:
    if callable(event):
        return _presser.get()
    return None if isinstance(event, Stopped) else event.client
