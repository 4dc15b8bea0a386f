"""The door over real sockets, with somebody behind it who hears what is handed through."""

from __future__ import annotations

import contextlib
import logging
import socket
from collections.abc import Callable

import msgpack
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.frames import Frame, Opcode
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from hmcs.bus.service import UserError
from hmcs_console.serving.document import load_document
from hmcs_console.serving.gateway import (
    MOST_CONNECTIONS,
    MOST_OF_AN_ADDRESS,
    MOST_PAGES,
    Gateway,
    Served,
)
from support.doors import DEADLINE_S, PRESSED, Behind, Door, until, until_closed

TOKEN = "a-long-secret"
MakeDoor = Callable[..., Door]


def test_the_page_is_sent_with_a_policy_that_lets_nothing_else_in(make_door: MakeDoor) -> None:
    door = make_door()
    page = door.get()
    assert page.status == 200
    assert page.body == load_document().body  # type: ignore[attr-defined]
    policy = dict(
        part.split(" ", 1) for part in page.headers["Content-Security-Policy"].split("; ")
    )
    assert policy["default-src"] == "'none'"
    assert "'unsafe-inline'" not in policy["script-src"]
    assert policy["script-src"].count("'sha256-") == 1
    assert policy["frame-ancestors"] == policy["base-uri"] == policy["form-action"] == "'none'"
    assert page.headers["X-Content-Type-Options"] == "nosniff"
    zipped = door.get(**{"Accept-Encoding": "gzip"})
    assert zipped.headers["Content-Encoding"] == "gzip"
    assert zipped.body == load_document().zipped  # type: ignore[attr-defined]


def test_there_is_nothing_but_the_page(make_door: MakeDoor) -> None:
    door = make_door()
    assert door.get("/other").status == 404
    assert door.get("/..%2f..%2fetc/passwd").status == 404
    for method in ("POST", "HEAD", "PUT", "OPTIONS"):
        assert door.get(method=method).status == 405


@pytest.mark.parametrize(
    "head",
    [
        b"Host: [::1",
        b"Host: 127.0.0.1\r\nOrigin: http://[::1",
        b"Host: 127.0.0.1\r\nOrigin: x",
        b"Host: a b",
        b"no colon",
        b"\xff\xfe",
    ],
)
def test_a_malformed_head_is_reported_and_no_more(make_door: MakeDoor, head: bytes) -> None:
    door = make_door()
    assert door.said(b"GET / HTTP/1.1\r\n" + head + b"\r\n\r\n").startswith(b"HTTP/1.1 400 ")
    assert door.lines == []


def test_a_head_without_an_end_is_too_large(make_door: MakeDoor) -> None:
    assert make_door().said(b"GET / HTTP/1.1\r\n" + b"x" * 100_000).startswith(b"HTTP/1.1 431 ")


def test_what_a_page_says_and_hears_is_handed_through(make_door: MakeDoor, behind: Behind) -> None:
    with make_door().page() as page:
        assert page.recv(timeout=DEADLINE_S) == b"hello"
        page.send(msgpack.packb(PRESSED))
        page.send([msgpack.packb(PRESSED)[:3], msgpack.packb(PRESSED)[3:]])
        until(lambda: len(behind.heard) == 2)
    assert behind.heard == [PRESSED, PRESSED]
    # Nothing of a browser's own request is.
    assert "user-agent" not in behind.requests[0].lower()


def test_a_page_of_another_version_is_warned(make_door: MakeDoor) -> None:
    door = make_door()
    for protocols in ([Subprotocol("viser-v0.0.0")], None):
        with pytest.raises(InvalidStatus) as refused:
            connect(f"ws://127.0.0.1:{door.port}", subprotocols=protocols)
        assert refused.value.response.status_code == 400
        assert b"load it anew" in refused.value.response.body


HOSTILE = (
    Frame(Opcode.TEXT, b"{}").serialize(mask=True),
    Frame(Opcode.BINARY, b"\xc1").serialize(mask=True),
    Frame(Opcode.BINARY, msgpack.packb({"type": "ShareUrlRequest"})).serialize(mask=True),
    Frame(Opcode.BINARY, b"x").serialize(mask=False),
    b"\x82\xff" + (2**62).to_bytes(8, "big"),
    b"\xff" * 100,
)


def test_hostile_frames_end_their_connection_with_a_line_a_period(
    make_door: MakeDoor, behind: Behind, capfd: pytest.CaptureFixture[str]
) -> None:
    door = make_door()
    for _ in range(10):
        for frame in HOSTILE:
            with door.page() as page:
                page.recv(timeout=DEADLINE_S)
                page.socket.sendall(frame)
                with pytest.raises(ConnectionClosed):
                    page.recv(timeout=DEADLINE_S)
    assert len(door.refused) == 10 * len(HOSTILE)
    assert behind.heard == []
    # Some periods may have gone by.
    assert len(door.lines) < len(HOSTILE)
    assert not any(line.exc_info for line in door.lines)
    until(lambda: door.gateway._pages == 0 and not door.gateway._connections)
    said = capfd.readouterr()
    assert "Traceback" not in said.out + said.err


def test_one_pages_hostility_is_not_anothers(make_door: MakeDoor, behind: Behind) -> None:
    door = make_door()
    with door.page() as friendly, door.page() as hostile:
        hostile.socket.sendall(HOSTILE[0])
        until(lambda: door.refused)
        friendly.send(msgpack.packb(PRESSED))
        until(lambda: behind.heard == [PRESSED])


def test_so_many_pages_are_open_at_once(make_door: MakeDoor) -> None:
    door = make_door()
    with contextlib.ExitStack() as stack:
        pages = [stack.enter_context(door.page()) for _ in range(MOST_PAGES)]
        with pytest.raises(InvalidStatus) as refused:
            door.page()
        assert refused.value.response.status_code == 503
        pages[0].close()
        until(lambda: door.gateway._pages < MOST_PAGES)
        stack.enter_context(door.page())


def test_so_many_connections_are_open_at_once_and_the_others_are_closed(
    make_door: MakeDoor,
) -> None:
    door = make_door()
    assert MOST_OF_AN_ADDRESS < MOST_CONNECTIONS
    with contextlib.ExitStack() as stack:
        idle = [
            stack.enter_context(socket.create_connection(("127.0.0.1", door.port)))
            for _ in range(2 * MOST_CONNECTIONS)
        ]
        until(lambda: len(door.refused) == 2 * MOST_CONNECTIONS - MOST_OF_AN_ADDRESS)
        assert door.gateway._connections.total() == MOST_OF_AN_ADDRESS
        for connection in idle[MOST_OF_AN_ADDRESS:]:
            connection.settimeout(DEADLINE_S)
            assert until_closed(connection) == b""
        assert len(door.lines) == 1
    until(lambda: not door.gateway._connections)
    assert door.get().status == 200


def test_wrong_tokens_are_reported_seldom_with_where_they_came_from_and_soon_have_to_wait(
    make_door: MakeDoor,
) -> None:
    door = make_door(token=TOKEN)
    answers = [door.get(f"/?token=guess-{number}") for number in range(50)]
    # Some wait may have gone by.
    assert sum(answer.status == 429 for answer in answers) > 30
    assert int(next(a for a in answers if a.status == 429).headers["Retry-After"]) >= 1
    assert 1 <= len(door.lines) < 10
    reported = vars(door.lines[0])
    assert reported["address"] == "127.0.0.1"
    assert "wrong token" in reported["reason"]
    assert not any(TOKEN in str(vars(line)) or "guess" in str(vars(line)) for line in door.lines)


def test_who_brings_the_token_is_let_in_by_a_session(make_door: MakeDoor) -> None:
    door = make_door(token=TOKEN)
    assert door.get().status == 401
    with pytest.raises(InvalidStatus):
        door.page()
    brought = door.get(f"/?token={TOKEN}")
    assert (brought.status, brought.headers["Location"]) == (303, "/")
    cookie = brought.headers["Set-Cookie"].partition(";")[0]
    assert TOKEN not in brought.headers["Set-Cookie"]
    # Cookies of a host are sent to all of its ports.
    assert str(door.port) in cookie
    assert door.get(Cookie=cookie).status == 200
    with door.page(additional_headers={"Cookie": cookie}) as page:
        assert page.recv(timeout=DEADLINE_S) == b"hello"


def test_a_page_without_a_token_is_not_served_where_others_reach_it(behind: Behind) -> None:
    for host in ("0.0.0.0", ""):
        with pytest.raises(UserError, match="reached from other machines: give a token"):
            Gateway(Served(host, 0), behind, logging.getLogger("x"), lambda _: None)
