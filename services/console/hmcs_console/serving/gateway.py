"""The door of the page: answers what is asked for over HTTP, and hands WebSockets through.

The page's own server listens at a loopback port, and hears nobody but this door: requests that were
made here, and messages that were read here.

A browser that sends more than any hand makes it send, or what no page says, is sent away. To slow
it down would be worse: what its operator did last would wait behind all of that, and letting go
with it.
"""

from __future__ import annotations

import asyncio
import logging
import ssl
import threading
from collections import Counter
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from typing import Any, NamedTuple, Protocol

from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.service import UserError
from hmcs_console.seeing.reports import asked_report
from hmcs_console.serving.admission import Admission, Head, head_of
from hmcs_console.serving.answers import (
    answer,
    asks_for_socket,
    document_for,
    report_for,
    request_for_socket,
    wrong_with_socket,
)
from hmcs_console.serving.document import load_document
from hmcs_console.serving.frames import Incoming
from hmcs_console.serving.places import doors, is_loopback
from hmcs_console.serving.said_by_pages import HostileError

MOST_CONNECTIONS = 64
MOST_OF_AN_ADDRESS = 48
"""Connections, so that one that opens all it can leaves some for others."""
MOST_PAGES = 16
"""That are open at once."""
_HEAD_BYTES = 65_536
_HEAD_WITHIN_S = 10.0
_ENCRYPTED_WITHIN_S = 5.0
_READ_WITHIN_S = 20.0
"""A browser that has not read for so long is gone."""
_CHUNK_BYTES = 65_536
_PORTS_TRIED = 100
_COOKIE = "hmcs_console_{port}"
"""By port: a browser sends cookies of a host to all of its ports."""


class Served(NamedTuple):
    """Where the page is served, and to whom."""

    host: str
    port: int
    """0 for any free one; the next free one where it is taken."""
    token: str | None = None
    """None lets in everybody who can reach a loopback address."""
    names: tuple[str, ...] = ()
    """The page is known under, beside its addresses."""
    encryption: ssl.SSLContext | None = None
    """None where connections are not encrypted."""


class PageServer(Protocol):
    """The page's own server."""

    def get_port(self) -> int:
        """Return the loopback port it listens at."""

    def expects(self, port: int) -> AbstractContextManager[None]:
        """Let in who comes from a loopback port, as long as the context lasts."""


class Gateway:
    """Serves the page; `port` is the one that was free."""

    def __init__(
        self,
        served: Served,
        page: PageServer,
        log: logging.Logger,
        refused: Callable[[str], None],
        reports: Callable[[str], bytes | None] = lambda _: None,
    ) -> None:
        """Open the door to the page; tell `refused` what is turned away, and why.

        `reports` returns the report of a name, on any thread; None where there is none.

        Raises UserError where neither the port nor one of those after it can be listened at, and
        where others could reach a page without a token.
        """
        self._served = served
        self._page = page
        self._refused = refused
        self._reports = reports
        self._limited = RateLimitedLog(log)
        self._document = load_document()
        self._connections: Counter[str] = Counter()
        self._pages = 0
        self._closing = False
        self._loop = asyncio.new_event_loop()
        self._loop.set_exception_handler(self._failed)
        self._thread = threading.Thread(target=self._loop.run_forever, name="gateway", daemon=True)
        self._thread.start()
        try:
            self._server = self._await(self._listen())
        except OSError as error:
            self._stop_loop()
            raise UserError(
                f"the page cannot be served at {served.host}:{served.port}: {error.strerror}: "
                "give another host or port"
            ) from error
        at = [listening.getsockname() for listening in self._server.sockets]
        self.port: int = at[0][1]
        addresses = [address[0] for address in at]
        self._admission = Admission(
            doors(served.host, addresses, served.names),
            served.token,
            cookie=_COOKIE.format(port=self.port),
            secure=served.encryption is not None,
        )
        if served.token is None and not all(map(is_loopback, addresses)):
            self.close()
            raise UserError(
                f"host {served.host} is {', '.join(addresses)} here, which can be reached from "
                "other machines: give a token, or a loopback host"
            )
        self._await(self._open())

    def close(self) -> None:
        """Shut it, with all that is open."""
        self._await(self._shut())
        self._stop_loop()

    def _await(self, doing: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(doing, self._loop).result()

    async def _listen(self) -> asyncio.Server:
        host, port = self._served.host, self._served.port
        tried = [port] if port == 0 else range(port, min(port + _PORTS_TRIED, 65_536))
        for candidate in tried:
            try:
                return await asyncio.start_server(
                    self._serve,
                    host,
                    candidate,
                    limit=_HEAD_BYTES,
                    reuse_address=True,
                    start_serving=False,
                )
            except OSError as error:
                failure = error
        raise failure

    async def _open(self) -> None:
        await self._server.start_serving()

    async def _shut(self) -> None:
        self._closing = True
        self._server.close()
        tasks = [task for task in asyncio.all_tasks() if task is not asyncio.current_task()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _stop_loop(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _failed(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        reason = f"{context['message']}: {type(error).__name__}: {error}"
        self._limited.warning("failure", "a connection failed", reason=reason)

    # --- connections ------------------------------------------------------------------------------

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        address = str((writer.get_extra_info("peername") or ("nowhere",))[0])
        crowded = self._connections.total() >= MOST_CONNECTIONS
        if crowded or self._connections[address] >= MOST_OF_AN_ADDRESS:
            self._turn_away("connections", "a connection is closed", address, "there are too many")
            writer.transport.abort()
            return
        self._connections[address] += 1
        # Streams print a traceback of a task that ends as canceled.
        ended = (OSError, EOFError, TimeoutError, asyncio.LimitOverrunError, asyncio.CancelledError)
        try:
            with suppress(*ended):
                await self._converse(reader, writer, address)
        except HostileError as error:
            # Closed without a word: the page's server may be in the middle of one.
            writer.transport.abort()
            self._turn_away("frames", "a browser is sent away", address, str(error))
        finally:
            if self._closing:
                writer.transport.abort()
            with suppress(*ended):
                await _close(writer)
            self._connections[address] -= 1
            if not self._connections[address]:
                del self._connections[address]

    async def _converse(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, address: str
    ) -> None:
        if self._served.encryption is not None:
            await writer.start_tls(
                self._served.encryption, ssl_handshake_timeout=_ENCRYPTED_WITHIN_S
            )
        try:
            async with asyncio.timeout(_HEAD_WITHIN_S):
                head = head_of(await reader.readuntil(b"\r\n\r\n"))
        except asyncio.LimitOverrunError:
            await _send(writer, answer(431, f"a request's head has at most {_HEAD_BYTES} bytes"))
            return
        verdict = self._admission.judge(head, address, self._loop.time())
        if verdict.status is not None or head is None:
            if verdict.wrong_tokens:
                reason = f"wrong token number {verdict.wrong_tokens} of its address"
                self._turn_away("token", "a browser is not let in", address, reason)
            status = verdict.status or 400
            await _send(writer, answer(status, verdict.reason, verdict.headers))
        elif asks_for_socket(head):
            await self._open_page(head, reader, writer, address)
        elif head.method == "GET" and (report := asked_report(head.path)):
            # Reading must not hold up what operators of open pages do.
            await _send(writer, report_for(await asyncio.to_thread(self._reports, report)))
        else:
            await _send(writer, document_for(head, self._document))

    async def _open_page(
        self, head: Head, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, address: str
    ) -> None:
        wrong, status = wrong_with_socket(head), 400
        if not wrong and self._pages >= MOST_PAGES:
            wrong, status = f"{MOST_PAGES} pages are open already: close one", 503
        if wrong:
            self._turn_away("page", "a page is not opened", address, wrong)
            await _send(writer, answer(status, wrong))
            return
        self._pages += 1
        try:
            await self._hand_through(head, reader, writer)
        finally:
            self._pages -= 1

    async def _hand_through(
        self, head: Head, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        port = self._page.get_port()
        page_reader, page_writer = await asyncio.open_connection("127.0.0.1", port)
        with self._page.expects(page_writer.get_extra_info("sockname")[1]):
            page_writer.write(request_for_socket(head, port))
            ways = [
                asyncio.ensure_future(self._pipe_in(reader, page_writer)),
                asyncio.ensure_future(_pipe(page_reader, writer)),
            ]
            try:
                # Either side gone ends both: a closed page is to be noticed at once.
                await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for way in ways:
                    way.cancel()
                came = await asyncio.gather(*ways, return_exceptions=True)
                page_writer.close()
        for failure in came:
            if isinstance(failure, HostileError):
                raise failure

    async def _pipe_in(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        incoming = Incoming(self._loop.time, self._left_out)
        while data := await reader.read(_CHUNK_BYTES):
            await _send(writer, incoming.take(data))

    def _left_out(self, reason: str) -> None:
        self._refused(reason)
        self._limited.warning("nonsense", "a message of a browser is left out", reason=reason)

    def _turn_away(self, kind: str, event: str, address: str, reason: str) -> None:
        self._refused(event)
        self._limited.warning(kind, event, address=address, reason=reason)


async def _pipe(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(_CHUNK_BYTES):
        await _send(writer, data)


async def _send(writer: asyncio.StreamWriter, data: bytes) -> None:
    """Send; raises TimeoutError where its reader does not read."""
    writer.write(data)
    async with asyncio.timeout(_READ_WITHIN_S):
        await writer.drain()


async def _close(writer: asyncio.StreamWriter) -> None:
    """Close, after what is still to be sent; a reader that is too slow is cut off."""
    writer.close()
    try:
        async with asyncio.timeout(_READ_WITHIN_S):
            await writer.wait_closed()
    finally:
        writer.transport.abort()
