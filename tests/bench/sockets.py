"""Frames over raw TCP sockets: the floor that figures of speed are measured against.

A frame is four bytes of length, eight bytes of the time its cause was made (ns of the monotonic
clock, which all processes of a machine share), and the payload.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator
from typing import NamedTuple

_HEAD = struct.Struct("<IQ")
_PATIENCE_S = 30.0


class Frame(NamedTuple):
    """One message."""

    caused_ns: int
    payload: bytes


def listen() -> tuple[socket.socket, int]:
    """Return a listening socket and its port."""
    server = socket.create_server(("127.0.0.1", 0))
    server.settimeout(_PATIENCE_S)
    return server, server.getsockname()[1]


def accept(server: socket.socket) -> socket.socket:
    """Return the next connection."""
    connection, _ = server.accept()
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return connection


def connect(port: int) -> socket.socket:
    """Return a connection to a process of this machine that listens."""
    connection = socket.create_connection(("127.0.0.1", port), timeout=_PATIENCE_S)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.settimeout(None)
    return connection


def send(connection: socket.socket, frame: Frame) -> None:
    """Send one frame."""
    connection.sendall(_HEAD.pack(len(frame.payload), frame.caused_ns) + frame.payload)


def frames(connection: socket.socket) -> Iterator[Frame]:
    """Yield frames until the other side is gone."""
    with connection.makefile("rb") as stream:
        while len(head := stream.read(_HEAD.size)) == _HEAD.size:
            size, caused_ns = _HEAD.unpack(head)
            yield Frame(caused_ns, stream.read(size))
