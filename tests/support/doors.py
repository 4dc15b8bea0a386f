"""The door of the page over real sockets, with somebody behind it who hears what comes through."""

from __future__ import annotations

import contextlib
import http.client
import logging
import socket
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import msgpack
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.sync.server import Server, ServerConnection, serve
from websockets.typing import Subprotocol

from hmcs_console.serving.gateway import Gateway, Served

DEADLINE_S = 20.0
PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
PRESSED = {"type": "CommandTriggerMessage", "uuid": "abc"}
"""What a page says."""


class Behind:
    """The page's own server: it hears, and says what it was made to say."""

    def __init__(self) -> None:
        self.heard: list[Any] = []
        self.requests: list[str] = []
        self._server: Server = serve(
            self._converse, "127.0.0.1", 0, subprotocols=[PROTOCOL], compression=None
        )
        self.expected: list[int] = []
        self._thread = threading.Thread(target=self._server.serve_forever)
        self._thread.start()

    def get_port(self) -> int:
        return int(self._server.socket.getsockname()[1])

    @contextlib.contextmanager
    def expects(self, port: int) -> Iterator[None]:
        self.expected.append(port)
        yield
        self.expected.remove(port)

    def close(self) -> None:
        self._server.shutdown()
        self._thread.join()

    def _converse(self, connection: ServerConnection) -> None:
        assert connection.request is not None
        assert connection.remote_address[1] in self.expected
        self.requests.append(str(connection.request.headers))
        connection.send(b"hello")
        with contextlib.suppress(ConnectionClosed):
            for message in connection:
                self.heard.append(msgpack.unpackb(message))  # type: ignore[arg-type]


class Door:
    """A gateway, and what it says."""

    def __init__(
        self,
        behind: Behind,
        served: Served,
        reports: Callable[[str], bytes | None] = lambda _: None,
    ) -> None:
        self.log = logging.Logger("door")
        self.lines: list[logging.LogRecord] = []
        handler = logging.Handler()
        handler.emit = self.lines.append  # type: ignore[method-assign]
        self.log.addHandler(handler)
        self.refused: list[str] = []
        self.gateway = Gateway(served, behind, self.log, self.refused.append, reports)
        self.port = self.gateway.port

    def page(self, **settings: Any) -> Any:
        """A page that is open, as far as the wire can tell."""
        scheme = "wss" if "ssl" in settings else "ws"
        return connect(
            f"{scheme}://127.0.0.1:{self.port}",
            subprotocols=[PROTOCOL],
            compression=None,
            open_timeout=DEADLINE_S,
            **settings,
        )

    def get(self, path: str = "/", method: str = "GET", **headers: str) -> http.client.HTTPResponse:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=DEADLINE_S)
        connection.request(method, path, headers=headers)
        response = connection.getresponse()
        response.body = response.read()  # type: ignore[attr-defined]
        connection.close()
        return response

    def said(self, data: bytes) -> bytes:
        """What it answers to bytes, until it closes."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=DEADLINE_S) as raw:
            raw.sendall(data)
            return until_closed(raw)


def until(condition: Callable[[], object]) -> None:
    deadline_s = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < deadline_s
        time.sleep(0.005)


def until_closed(raw: socket.socket) -> bytes:
    heard = b""
    with contextlib.suppress(ConnectionError):
        while data := raw.recv(65_536):
            heard += data
    return heard
