"""What passes between the two rooms of the robot: the wire room and the control room.

Datagrams on a pair of local sockets: whole or not at all, never waiting, newest ones dropped where
nobody reads. Towards control only small, already validated orders go; back come snapshots.
"""

from __future__ import annotations

import hashlib
import socket
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

import msgpack
import numpy as np

from hmcs.arrays import Array
from hmcs.supervision import Order, Stop

LARGEST_BYTES = 65_536
"""Of a datagram: a snapshot with hundreds of contacts is smaller."""
READ_AT_ONCE = 64
"""Datagrams taken in one tick of control: more would hold it up."""

_ORDER = struct.Struct("<BQ16sqq?6d")
_SIGN = struct.Struct("<BQ")
_STOP = struct.Struct("<B")
_UNPAIRED = struct.Struct("<B16s")
_ORDER_KIND, _SIGN_KIND, _STOP_KIND, _UNPAIRED_KIND = range(1, 5)


class Numbered(NamedTuple):
    """An order and its number in the wire room, to tell which one was taken last."""

    number: int
    order: Order


class SignOfLife(NamedTuple):
    """The wire room goes round; it has refused so many commands since it started."""

    refused: int


class StopAsked(NamedTuple):
    """Somebody asked the robot to stand."""


class Unpaired(NamedTuple):
    """A fixture controller drives another robot: its commands are not for this one."""

    writer: bytes


Request = Numbered | SignOfLife | StopAsked | Unpaired


class Snapshot(NamedTuple):
    """What control says of the arm, after a tick."""

    joint_positions: Array
    joint_velocities: Array
    tool_position: Array
    tool_orientation: Array
    tool_twist: Array
    reference_twist: Array
    nearest_obstacle: str
    nearest_distance_m: float | None
    contacts: tuple[str, ...]
    stop: Stop
    limited: tuple[str, ...]
    region_distance_m: float | None
    late_ticks: int
    command_age_s: float | None
    """Since the last order was taken; None before the first."""
    taken: int
    """Number of the order that was taken last; −1 before the first."""
    late_orders: int
    """Orders that came too late, since the start."""
    foreign_orders: int
    """Orders of a second writer, since the start."""


_ARRAYS = Snapshot._fields[:6]


def writer_id(boot: str) -> bytes:
    """Return 16 bytes that stand for the boot of a writer."""
    return hashlib.blake2b(boot.encode(), digest_size=16).digest()


class Closed(Exception):  # noqa: N818 - the end of the other room is no error of this one
    """The other room is gone."""


class Channel:
    """One end of the pair of sockets."""

    def __init__(self, end: socket.socket) -> None:
        end.setblocking(False)
        self._end = end

    @classmethod
    def pair(cls) -> tuple[Channel, socket.socket]:
        """Return an end of a new pair, and the other for a child process."""
        here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        return cls(here), there

    def send(self, data: bytes) -> bool:
        """Send a datagram; False where the other room does not read. Raises Closed."""
        try:
            self._end.send(data)
        except (BlockingIOError, InterruptedError):
            return False
        except OSError as error:
            raise Closed from error
        return True

    def receive(self) -> bytes | None:
        """Return the next datagram, None where there is none. Raises Closed."""
        try:
            data = self._end.recv(LARGEST_BYTES)
        except (BlockingIOError, InterruptedError):
            return None
        except OSError as error:
            raise Closed from error
        if not data:
            raise Closed
        return data

    def fileno(self) -> int:
        """Return the descriptor, to wait for something to read."""
        return self._end.fileno()

    def close(self) -> None:
        """Close this end."""
        self._end.close()


# --- towards control ------------------------------------------------------------------------------


def pack_order(number: int, order: Order) -> bytes:
    """Return an order as a datagram."""
    return _ORDER.pack(
        _ORDER_KIND,
        number,
        order.writer,
        order.received_ns,
        order.valid_for_ns,
        order.engaged,
        *order.twist.tolist(),
    )


def pack_sign(refused: int) -> bytes:
    """Return a sign of life as a datagram."""
    return _SIGN.pack(_SIGN_KIND, refused)


def pack_stop() -> bytes:
    """Return the request to stand as a datagram."""
    return _STOP.pack(_STOP_KIND)


def pack_unpaired(writer: bytes) -> bytes:
    """Return that the commands of a writer are not for this robot, as a datagram."""
    return _UNPAIRED.pack(_UNPAIRED_KIND, writer)


def requests(channel: Channel) -> Iterator[Request]:
    """Yield what the wire room has sent, as much as one tick may take. Raises Closed."""
    for _ in range(READ_AT_ONCE):
        data = channel.receive()
        if data is None:
            return
        kind = data[0]
        if kind == _ORDER_KIND:
            _, number, writer, received_ns, valid_for_ns, engaged, *twist = _ORDER.unpack(data)
            yield Numbered(
                number, Order(writer, np.array(twist), valid_for_ns, engaged, received_ns)
            )
        elif kind == _SIGN_KIND:
            yield SignOfLife(_SIGN.unpack(data)[1])
        elif kind == _STOP_KIND:
            yield StopAsked()
        else:
            yield Unpaired(_UNPAIRED.unpack(data)[1])


# --- back to the wire room ------------------------------------------------------------------------


def pack_snapshot(snapshot: Snapshot) -> bytes:
    """Return a snapshot as a datagram."""
    values: list[Any] = list(snapshot)
    for place in range(len(_ARRAYS)):
        values[place] = values[place].tobytes()
    packed: bytes = msgpack.packb(values)
    return packed


def unpack_snapshot(data: bytes) -> Snapshot:
    """Return the snapshot in a datagram of `pack_snapshot`."""
    values = msgpack.unpackb(data, use_list=False)
    arrays = [np.frombuffer(values[place]) for place in range(len(_ARRAYS))]
    return Snapshot._make([*arrays, *values[len(_ARRAYS) :]])
