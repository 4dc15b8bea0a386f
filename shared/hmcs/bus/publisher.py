"""Publishing one type of message on one key."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

import zenoh

from hmcs.bus.counters import Counters
from hmcs.bus.messages import Envelope, Message, Origin
from hmcs.bus.qos import QosProfile
from hmcs.bus.wire import encode

M = TypeVar("M", bound=Message)


class Publisher(Generic[M]):
    """Publishes one type of message on one key; made by `Bus.publisher`."""

    def __init__(
        self,
        publisher: zenoh.Publisher,
        stamp: Callable[[Origin | None], Envelope],
        counters: Counters,
        sender: bytes,
    ) -> None:
        self._publisher = publisher
        self._stamp = stamp
        self._counters = counters
        self._sender = sender

    def put(self, body: M, origin: Origin | None = None) -> Envelope:
        """Publish `body`; returns the envelope it got.

        While there is no router the message is discarded, and its receivers will miss its number.
        """
        envelope = self._stamp(origin)
        self._publisher.put(encode(body, envelope), attachment=self._sender)
        self._counters.sent[body.SCHEMA] += 1
        return envelope

    @property
    def matching(self) -> bool:
        """Whether anybody subscribes to it now."""
        # The status itself is always truthy; its annotation as a bool is Zenoh's mistake.
        return bool(getattr(self._publisher.matching_status, "matching"))  # noqa: B009


def declare_publisher(session: zenoh.Session, key: str, profile: QosProfile) -> zenoh.Publisher:
    """Declare a publisher on `key` that sends as `profile` says."""
    return session.declare_publisher(
        key,
        priority=getattr(zenoh.Priority, profile.priority.upper()),
        congestion_control=getattr(zenoh.CongestionControl, profile.congestion.upper()),
        reliability=getattr(zenoh.Reliability, profile.reliability.upper()),
        express=False,
    )
