"""From bytes that arrived to messages that may be handled; counts what is refused, lost or late."""

from __future__ import annotations

from typing import Generic, NamedTuple, TypeVar

from hmcs.bus.counters import Counters, Sequences
from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.mailbox import Arrival
from hmcs.bus.messages import Envelope, Message
from hmcs.bus.wire import RefusedMessageError, check_size, decode, envelope_of

M = TypeVar("M", bound=Message)


class Received(NamedTuple, Generic[M]):
    """A message as a handler gets it."""

    body: M
    envelope: Envelope
    received_ns: int
    """When it reached this process, by its own monotonic clock."""
    key: str


class Reader:
    """Decodes what arrived, counts it, and follows the sequence numbers of its sources."""

    def __init__(self, counters: Counters, seldom: RateLimitedLog) -> None:
        self._counters = counters
        self._limited = seldom
        self._sequences = Sequences()

    def read(
        self, message_type: type[M], arrival: Arrival, *, keep_last: bool
    ) -> Received[M] | None:
        """Return the message that arrived, or None where it cannot be used.

        Refused is what is no message of `message_type`. Where the newest wins, late is what is
        numbered below an earlier one of the same source and key.
        """
        schema = message_type.SCHEMA
        self._counters.received[schema] += 1 + arrival.overwritten
        try:
            check_size(arrival.size_bytes, message_type)
            envelope, body = decode(arrival.payload, message_type)
        except RefusedMessageError as error:
            self.refuse(schema, arrival.key, error)
            refused = envelope_of(arrival.payload, message_type)
            if refused is not None:
                # It is no loss: it did arrive.
                self._note(arrival, refused, schema)
            return None
        is_news = self._note(arrival, envelope, schema)
        if keep_last and not is_news:
            self._counters.count_late(schema)
            return None
        return Received(body, envelope, arrival.received_ns, arrival.key)

    def refuse(self, schema: str, key: str, error: RefusedMessageError) -> None:
        """Count and log what came on `key` and is no message of `schema`."""
        self._counters.count_refused(schema, str(error))
        self._limited.warning(f"refused {key}", "message refused", key=key, reason=str(error))

    def overflowed(self, key: str) -> None:
        """Log that messages on `key` find no place to wait."""
        self._limited.warning(
            f"overflow {key}", "messages come faster than they are handled: some are lost", key=key
        )

    def _note(self, arrival: Arrival, envelope: Envelope, schema: str) -> bool:
        lost = self._sequences.note(
            arrival.key, envelope.source.boot, envelope.seq, arrival.overwritten
        )
        if lost:
            self._counters.lost[schema] += lost
            source = f"{envelope.source.service}/{envelope.source.instance}"
            self._limited.warning(
                f"lost {arrival.key}", "messages lost", key=arrival.key, source=source, lost=lost
            )
        return lost is not None
