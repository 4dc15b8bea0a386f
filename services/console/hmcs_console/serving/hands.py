"""What viewers do with their pages is carried out: handles are sent, floods are held back."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.messages import Handle
from hmcs.bus.session import Bus
from hmcs_console.operating.handles import Gone, Operating, Outcome, Stopped, after, waited
from hmcs_console.serving.page import Page

FLOOD = "page"
"""As what too much of a page is counted among what was refused."""


class Hands:
    """Follows the viewers of a page; called on the bus' own thread."""

    def __init__(
        self,
        page: Page,
        bus: Bus,
        lease_s: float,
        log: logging.Logger,
        stopped: Callable[[], None],
    ) -> None:
        """Call `stopped` when a viewer wants every robot to stand."""
        self._page = page
        self._counters = bus.counters
        self._lease_s = lease_s
        self._log = log
        self._limited = RateLimitedLog(log)
        self._stopped = stopped
        self._handles = bus.publisher(Handle, bus.keys.handle)
        self._flooding: set[int] = set()
        """Pages that were warned that they send too much."""
        self.lost: dict[int, str] = {}
        """Why a page does not operate any more that did last, by its number."""
        self.operating = Operating(bus.source.instance)
        """How the pages operate now."""

    def take(self) -> None:
        """Do what viewers want, end what has lapsed."""
        taken = self._page.take_events()
        for event in taken.events:
            if callable(event):
                event()
                continue
            self._follow(after(self.operating, event))
            if isinstance(event, Stopped):
                self._stopped()
            elif isinstance(event, Gone):
                self._flooding.discard(event.client)
                self.lost.pop(event.client, None)
        for client, count in taken.dropped.items():
            self._flooded(client, count)
        self._follow(waited(self.operating, time.monotonic(), self._lease_s))

    def tell_handle(self) -> None:
        """Tell where a held handle is."""
        handle = self.operating.handle(time.monotonic())
        if handle is not None:
            self._handles.put(handle)

    def let_go(self) -> None:
        """Release the handle, no matter who holds it."""
        self._follow(after(self.operating, Stopped()))

    def _follow(self, outcome: Outcome) -> None:
        before, self.operating = self.operating, outcome.operating
        for handle in outcome.handles:
            self._handles.put(handle)
        for client, text in outcome.notices:
            self._page.tell(client, text)
            if client == before.lease.client:
                self.lost[client] = text
        holder = self.operating.lease.client
        if holder is not None:
            self.lost.pop(holder, None)
        if holder != before.lease.client:
            self._page.hold(holder)
            operator = self.operating.operator
            self._log.info("operated" if operator else "let go", extra={"operator": operator})

    def _flooded(self, client: int | None, count: int) -> None:
        self._counters.refused[FLOOD] += count
        self._limited.warning(FLOOD, "more than a hand can do", page=client, dropped=count)
        if client is not None and client not in self._flooding:
            self._flooding.add(client)
            self._page.tell(client, "this page does more than a hand can: some of it is left out")
