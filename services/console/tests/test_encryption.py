"""The page over encrypted connections."""

from __future__ import annotations

import contextlib
import http.client
import socket
import ssl
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import msgpack
import pytest

from hmcs.bus.service import UserError
from hmcs_console.serving.document import load_document
from hmcs_console.serving.encryption import encryption
from hmcs_console.serving.gateway import MOST_CONNECTIONS, MOST_OF_AN_ADDRESS
from support.doors import DEADLINE_S, PRESSED, Behind, Door, until

CERTIFICATES = Path(__file__).parent / "certificates"
CERTIFICATE, KEY = CERTIFICATES / "localhost.pem", CERTIFICATES / "localhost.key"
TOKEN = "a-long-secret"
MakeDoor = Callable[..., Door]


@pytest.fixture
def trusting() -> ssl.SSLContext:
    return ssl.create_default_context(cafile=CERTIFICATE)


def test_with_a_certificate_the_page_is_served_encrypted_and_no_other_way(
    make_door: MakeDoor, behind: Behind, trusting: ssl.SSLContext
) -> None:
    door = make_door(token=TOKEN, encryption=encryption(CERTIFICATE, KEY))
    assert not door.said(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n").startswith(b"HTTP")
    connection = http.client.HTTPSConnection("127.0.0.1", door.port, context=trusting)
    connection.request("GET", f"/?token={TOKEN}")
    brought = connection.getresponse()
    assert brought.status == 303
    cookie = brought.headers["Set-Cookie"]
    assert "Secure" in cookie.split("; ")
    headers = {"Cookie": cookie.partition(";")[0], "Origin": f"https://127.0.0.1:{door.port}"}
    with door.page(ssl=trusting, additional_headers=headers) as page:
        assert page.recv(timeout=DEADLINE_S) == b"hello"
        page.send(msgpack.packb(PRESSED))
        until(lambda: behind.heard == [PRESSED])


def test_many_encrypted_connections_at_once_are_served(
    make_door: MakeDoor, trusting: ssl.SSLContext
) -> None:
    door = make_door(encryption=encryption(CERTIFICATE, KEY))

    def get(_: int) -> int:
        connection = http.client.HTTPSConnection(
            "127.0.0.1", door.port, context=trusting, timeout=DEADLINE_S
        )
        with contextlib.closing(connection):
            connection.request("GET", "/")
            return len(connection.getresponse().read())

    with ThreadPoolExecutor(20) as pool:
        assert set(pool.map(get, range(100))) == {len(load_document().body)}


def test_connections_that_never_say_hello_are_bounded_with_a_certificate_too(
    make_door: MakeDoor,
) -> None:
    door = make_door(encryption=encryption(CERTIFICATE, KEY))
    with contextlib.ExitStack() as stack:
        for _ in range(2 * MOST_CONNECTIONS):
            stack.enter_context(socket.create_connection(("127.0.0.1", door.port)))
        until(lambda: len(door.refused) == 2 * MOST_CONNECTIONS - MOST_OF_AN_ADDRESS)
    until(lambda: not door.gateway._connections)


@pytest.mark.parametrize(
    ("certificate", "key", "reported"),
    [
        ("nowhere.pem", KEY, "No such file"),
        (CERTIFICATE, "nowhere.key", "No such file"),
        (KEY, CERTIFICATE, "give PEM files"),
        (CERTIFICATE, CERTIFICATES / "with-password.key", "asks for a password"),
        (Path(__file__), KEY, "give PEM files"),
    ],
)
def test_a_certificate_that_cannot_be_used_is_reported(
    certificate: Path | str, key: Path | str, reported: str
) -> None:
    with pytest.raises(UserError, match=reported):
        encryption(Path(certificate), Path(key))
