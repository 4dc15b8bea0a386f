"""Fast messages as an observer wants them: the newest read whole, of the others only their cause.

A page is drawn far less often than hand and robot tell of themselves. Waking up for each message
and checking all of it would cost most of what a console costs.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import msgpack

from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.mailbox import Arrival
from hmcs.bus.messages import Message
from hmcs.bus.reading import Reader, Received
from hmcs.bus.session import Bus
from hmcs_console.seeing.hops import Cause

M = TypeVar("M", bound=Message)

EVERY_S = 0.03
"""How often is looked at what came meanwhile."""
_LONGEST_BOOT = 64
"""Characters, as in messages."""


class MessageHeader(NamedTuple):
    """What is read of every message."""

    sender: str
    """Boot of its source."""
    cause: Cause | None
    """None where no sample of an operator caused it."""


class Glance(Generic[M]):
    """Looks at the messages of one key."""

    def __init__(
        self,
        bus: Bus,
        message_type: type[M],
        key: str,
        seldom: RateLimitedLog,
        caused: Callable[[Cause, int], None],
        newest: Callable[[Received[M]], None],
    ) -> None:
        """Hand on the cause of each message with its arrival, monotonic ns, and the newest whole.

        Of several senders each has a newest one.
        """
        self._type = message_type
        self._reader = Reader(bus.counters, seldom)
        self._caused = caused
        self._newest = newest
        self._waiting: dict[str, Arrival] = {}
        bus.listen(key, self._take, EVERY_S)
        # After what came was taken: timers of one period go by their age.
        bus.every(EVERY_S, self._look)

    def _take(self, arrival: Arrival) -> None:
        header = header_of(arrival.payload)
        before = self._waiting.get(header.sender)
        overwritten = 0 if before is None else before.overwritten + 1
        self._waiting[header.sender] = arrival._replace(overwritten=overwritten)
        if header.cause is not None:
            self._caused(header.cause, arrival.received_ns)

    def _look(self) -> None:
        waiting, self._waiting = self._waiting, {}
        for arrival in waiting.values():
            received = self._reader.read(self._type, arrival, keep_last=True)
            if received is not None:
                self._newest(received)


def header_of(payload: bytes) -> MessageHeader:
    """Return who sent a message, and its cause, without checking the rest of it.

    What is no message has no sender and no cause; it is for others to refuse it.
    """
    try:
        fields: Any = msgpack.unpackb(payload, use_list=False)
        sender, origin = fields["source"]["boot"], fields["origin"]
        cause = None if origin is None else (origin["boot"], origin["seq"])
    except (ValueError, TypeError, LookupError, msgpack.UnpackException, RecursionError):
        return MessageHeader("", None)
    if not _is_boot(sender) or not (cause is None or _is_cause(cause)):
        return MessageHeader("", None)
    return MessageHeader(sender, cause)


def _is_boot(value: object) -> bool:
    return isinstance(value, str) and len(value) <= _LONGEST_BOOT


def _is_cause(value: tuple[object, object]) -> bool:
    boot, seq = value
    return _is_boot(boot) and isinstance(seq, int)
