"""Whether a process reaches its router, and a line in its log when that changes."""

from __future__ import annotations

import logging

import zenoh

from hmcs.bus.config import BusSettings
from hmcs.bus.mailbox import Mailbox
from hmcs.bus.zenoh_callbacks import on_thread


class Links:
    """The links of one Zenoh session; the thread that empties the mailbox handles changes."""

    def __init__(
        self,
        session: zenoh.Session,
        settings: BusSettings,
        log: logging.Logger,
        mailbox: Mailbox,
    ) -> None:
        self._session = session
        self._settings = settings
        self._log = log

        def event(event: zenoh.TransportEvent) -> None:
            # Known from the event: the session's own state lags behind it.
            peer, opened = str(event.transport.zid), event.kind == zenoh.SampleKind.PUT
            mailbox.put(lambda: self._changed(peer, opened))

        # Zenoh undeclares what nobody holds.
        self._listener = session.info.declare_transport_events_listener(on_thread(event))
        self._open = {str(zid) for zid in self._reached()}

    @property
    def connected(self) -> bool:
        """Whether the router (or, in direct mode, anybody) is reached now."""
        return bool(self._reached())

    def _reached(self) -> list[zenoh.ZenohId]:
        info = self._session.info
        return [*info.routers_zid(), *(info.peers_zid() if self._settings.direct else ())]

    def _changed(self, peer: str, opened: bool) -> None:
        was_connected = bool(self._open)
        (self._open.add if opened else self._open.discard)(peer)
        if bool(self._open) != was_connected:
            self._log.warning(
                "connected again" if opened else "connection lost: going on by itself",
                extra={"router": self._settings.router},
            )
