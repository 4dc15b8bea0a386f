"""Messages to bytes and back: one msgpack map holding the body's fields beside the envelope's."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import msgpack
import numpy as np
from pydantic import BaseModel, ValidationError

from hmcs.bus.arrays import FROM_WIRE, to_wire
from hmcs.bus.bounds import BOUNDS, MOST_FIELDS, Bound
from hmcs.bus.messages import Envelope, Message

M = TypeVar("M", bound=Message)

QUOTED_LETTERS = 300
"""How much of what a sender wrote stands in the reason of a refusal."""
_SMALL_BYTES = 4096
"""In so few bytes there is no room for elements enough to cost time."""


class RefusedMessageError(ValueError):
    """Bytes that are no message of the expected kind; says what was wrong and what was expected."""


class Decoded(NamedTuple):
    """A message as it was sent."""

    envelope: Envelope
    body: Message


def schema_of(message_type: type[Message]) -> str:
    """Return the name and version a message type has on the wire, e.g. `motion/1`."""
    return f"{message_type.SCHEMA}/{message_type.VERSION}"


def encode(body: Message, envelope: Envelope) -> bytes:
    """Return the bytes of one message."""
    fields: dict[str, Any] = {
        "schema": schema_of(type(body)),
        "source": envelope.source,
        "seq": envelope.seq,
        "origin": envelope.origin,
        **body.__dict__,
    }
    packed: bytes = msgpack.packb(fields, default=_plain)
    return packed


def decode(data: bytes, expected: type[M]) -> tuple[Envelope, M]:
    """Return envelope and body of a message of the expected type.

    Raises RefusedMessageError when the message is larger than its bound, the bytes are not
    msgpack, not a map, of another schema or version, or when a field is missing, mistyped,
    misshapen or not finite.
    """
    check_size(len(data), expected)
    fields = _unpacked(data, BOUNDS[expected])
    schema = fields.get("schema")
    if schema != schema_of(expected):
        named = f"{schema[:64]!r}" if isinstance(schema, str) else f"a {type(schema).__name__}"
        raise RefusedMessageError(
            f"schema {named}, expected {schema_of(expected)!r}: "
            "run the same version of hmcs on both sides"
        )
    try:
        return Envelope.model_validate(fields), expected.model_validate(fields, context=FROM_WIRE)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part)[:64] for part in first["loc"]) or "message"
        # Whatever the sender wrote stands in it.
        raise RefusedMessageError(f"{schema}: {where}: {first['msg'][:QUOTED_LETTERS]}") from error


def envelope_of(data: bytes, expected: type[Message]) -> Envelope | None:
    """Return the envelope of a message whose body was refused; None where that is none either."""
    try:
        check_size(len(data), expected)
        return Envelope.model_validate(_unpacked(data, BOUNDS[expected]))
    except (RefusedMessageError, ValidationError):
        return None


def check_size(size_bytes: int, *expected: type[Message]) -> None:
    """Raise RefusedMessageError for a message larger than all of the expected kinds may be."""
    largest = max(expected, key=lambda message_type: BOUNDS[message_type].size_bytes)
    bound = BOUNDS[largest]
    if size_bytes > bound.size_bytes:
        raise RefusedMessageError(
            f"{size_bytes} bytes, expected at most {bound.size_bytes} of a {schema_of(largest)}: "
            f"{bound.reason}"
        )


def _unpacked(data: bytes, bound: Bound) -> dict[Any, Any]:
    try:
        if len(data) <= _SMALL_BYTES:
            fields = msgpack.unpackb(data, use_list=False, max_map_len=MOST_FIELDS)
        else:
            count = _Count(bound.elements)
            fields = msgpack.unpackb(
                data,
                use_list=False,
                max_map_len=MOST_FIELDS,
                max_array_len=bound.elements,
                list_hook=count,
                object_hook=count,
            )
    except (ValueError, msgpack.UnpackException, RecursionError) as error:
        raise RefusedMessageError(
            f"not a msgpack message ({len(data)} bytes): {error or type(error).__name__}"
        ) from error
    if not isinstance(fields, dict):
        raise RefusedMessageError(f"a {type(fields).__name__}, expected a map of fields")
    return fields


class _Count:
    """Ends the decoding of a message that has more elements than are admitted."""

    def __init__(self, most: int) -> None:
        self._left = self._most = most

    def __call__(self, part: Any) -> Any:
        self._left -= 1 + len(part)
        if self._left < 0:
            raise ValueError(f"more than {self._most} elements")
        return part


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return to_wire(value)
    if isinstance(value, BaseModel):
        return value.__dict__
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a {type(value).__name__} cannot travel in a message")
