"""Messages to bytes and back: one msgpack map holding the body's fields beside the envelope's."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

import msgpack
import numpy as np
from pydantic import BaseModel, ValidationError

from hmcs.bus.arrays import FROM_WIRE, to_wire
from hmcs.bus.messages import Envelope, Message

M = TypeVar("M", bound=Message)


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

    Raises RefusedMessageError when the bytes are not msgpack, not a map, of another schema or
    version, or when a field is missing, mistyped, misshapen or not finite.
    """
    try:
        fields = msgpack.unpackb(data, use_list=False)
    except (ValueError, msgpack.UnpackException, RecursionError) as error:
        raise RefusedMessageError(
            f"not a msgpack message ({len(data)} bytes): {error or type(error).__name__}"
        ) from error
    if not isinstance(fields, dict):
        raise RefusedMessageError(f"a {type(fields).__name__}, expected a map of fields")
    schema = fields.get("schema")
    if schema != schema_of(expected):
        raise RefusedMessageError(
            f"schema {str(schema)[:64]!r}, expected {schema_of(expected)!r}: "
            "run the same version of hmcs on both sides"
        )
    try:
        return Envelope.model_validate(fields), expected.model_validate(fields, context=FROM_WIRE)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in first["loc"]) or "message"
        raise RefusedMessageError(f"{schema}: {where}: {first['msg']}") from error


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        return to_wire(value)
    if isinstance(value, BaseModel):
        return value.__dict__
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a {type(value).__name__} cannot travel in a message")
