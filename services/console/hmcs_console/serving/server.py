"""The library's server of the page, kept to this machine, and quiet."""

from __future__ import annotations

import asyncio
import contextlib
import io
import logging
from collections.abc import Iterator
from typing import Any

import viser
from viser.infra import WebsockClientConnection

from hmcs.bus.logs import RateLimitedLog
from hmcs.shown import plain

_LIBRARY_LOG = "websockets.server"


class Server(viser.ViserServer):
    """A viser server that hears nobody but the page's door, and reaches nobody beyond this machine.

    Any program here, and any page of any browser here, may find its port; the library asks nobody
    where they come from. What goes wrong in it is a line of the log, seldom, and no traceback.
    """

    def __init__(self, log: logging.Logger) -> None:
        with _quietly():
            super().__init__(host="127.0.0.1", port=0, label="HMCS", verbose=False)
        self._library_log = _LibraryLog(RateLimitedLog(log))
        library = logging.getLogger(_LIBRARY_LOG)
        library.addHandler(self._library_log)
        library.propagate = False
        self._expected: set[int] = set()
        self._websock_server.on_client_connect(self._turn_strangers_away)
        loop = self.get_event_loop()
        loop.call_soon_threadsafe(loop.set_exception_handler, self._library_log.failed)

    @contextlib.contextmanager
    def expects(self, port: int) -> Iterator[None]:
        """Let in who comes from a loopback port, as long as the context lasts."""
        self._expected.add(port)
        try:
            yield
        finally:
            self._expected.discard(port)

    async def _turn_strangers_away(self, come: WebsockClientConnection) -> None:
        # Before anything is heard of them.
        connection = self._websock_server._live_connections.get(come.client_id)
        if connection is not None and connection.remote_address[1] not in self._expected:
            await connection.close(1008)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse: a tunnel would let strangers move the robot."""
        return None

    def stop(self) -> None:
        """End, with all its threads."""
        logging.getLogger(_LIBRARY_LOG).removeHandler(self._library_log)
        with _quietly():
            super().stop()


class _LibraryLog(logging.Handler):
    """Hands on what the library says, and what fails in its tasks."""

    def __init__(self, seldom: RateLimitedLog) -> None:
        super().__init__(logging.WARNING)
        self._limited = seldom

    def emit(self, record: logging.LogRecord) -> None:
        error = record.exc_info[1] if record.exc_info else None
        self._tell(record.getMessage(), error)

    def failed(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Take in what failed in a task."""
        self._tell(context["message"], context.get("exception"))

    def _tell(self, what: str, error: BaseException | None) -> None:
        reason = what if error is None else f"{what}: {type(error).__name__}: {error}"
        self._limited.warning("library", "the page's server failed", reason=plain(reason))


@contextlib.contextmanager
def _quietly() -> Iterator[None]:
    # The library greets and takes its leave on standard output, where it has no business.
    with contextlib.redirect_stdout(io.StringIO()):
        yield
