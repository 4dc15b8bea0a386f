"""The door of the page: judges the first request of each connection, then hands bytes through.

The page itself listens at a loopback port nobody is told of. It closes a connection after one
answer unless that becomes a WebSocket, so judging the first request judges all.

A browser that sends more than any hand makes it send is sent away. To slow it down would be worse:
what its operator did last would wait behind all of that, and letting go with it.
"""

from __future__ import annotations

import asyncio
import logging
import threading
from contextlib import suppress

from hmcs.bus.logs import Seldom
from hmcs.bus.service import UserError
from hmcs_console.serving.admission import admit, head_of

_HEAD_BYTES = 65_536
_HEAD_WITHIN_S = 10.0
_CHUNK_BYTES = 65_536
_PORTS_TRIED = 100
MOST_BYTES_A_S = 400_000
"""From one browser; one whose handle is dragged while the camera turns sends a tenth of that."""


class Gateway:
    """Serves the page at a host and a port; `port` is the one that was free."""

    def __init__(
        self, host: str, port: int, page_port: int, token: str | None, log: logging.Logger
    ) -> None:
        """Open the door to the page at loopback `page_port`.

        Raises UserError where neither `port` nor one of those after it can be listened at.
        """
        self._page_port = page_port
        self._token = token
        self._seldom = Seldom(log)
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="gateway", daemon=True)
        self._thread.start()
        try:
            self._server = asyncio.run_coroutine_threadsafe(
                self._listen(host, port), self._loop
            ).result()
        except OSError as error:
            self._stop_loop()
            raise UserError(
                f"the page cannot be served at {host}:{port}: {error.strerror}: "
                "give another host or port"
            ) from error
        self.port: int = self._server.sockets[0].getsockname()[1]

    def close(self) -> None:
        """Shut it, with all that is open."""
        asyncio.run_coroutine_threadsafe(self._shut(), self._loop).result()
        self._stop_loop()

    async def _listen(self, host: str, port: int) -> asyncio.Server:
        tried = [port] if port == 0 else range(port, min(port + _PORTS_TRIED, 65_536))
        for candidate in tried:
            try:
                return await asyncio.start_server(
                    self._serve, host, candidate, limit=_HEAD_BYTES, reuse_address=True
                )
            except OSError as error:
                failure = error
        raise failure

    async def _shut(self) -> None:
        self._server.close()
        tasks = [task for task in asyncio.all_tasks() if task is not asyncio.current_task()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _stop_loop(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        # Streams print a traceback of a task that ends as canceled.
        ended = (OSError, EOFError, TimeoutError, asyncio.LimitOverrunError, asyncio.CancelledError)
        with suppress(*ended):
            try:
                async with asyncio.timeout(_HEAD_WITHIN_S):
                    head = await reader.readuntil(b"\r\n\r\n")
                answer = admit(head_of(head), self._token).answer
                if answer is not None:
                    writer.write(answer)
                    await writer.drain()
                    return
                await self._hand_through(head, reader, writer)
            finally:
                writer.close()

    async def _hand_through(
        self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        page_reader, page_writer = await asyncio.open_connection("127.0.0.1", self._page_port)
        page_writer.write(head)
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
            await asyncio.gather(*ways, return_exceptions=True)
            page_writer.close()

    async def _pipe_in(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        began_s, count = self._loop.time(), 0
        while data := await reader.read(_CHUNK_BYTES):
            now_s = self._loop.time()
            if now_s - began_s >= 1.0:
                began_s, count = now_s, 0
            count += len(data)
            if count > MOST_BYTES_A_S:
                self._seldom.warning("flood", "a browser sends too much: sent away", bytes=count)
                return
            writer.write(data)
            await writer.drain()


async def _pipe(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(_CHUNK_BYTES):
        writer.write(data)
        await writer.drain()
