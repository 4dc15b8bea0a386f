"""Messages as they stand in a recording: JSON whose numbers are read back bit by bit."""

from __future__ import annotations

import base64
from typing import Any, TypeVar

import msgpack
import numpy as np
from pydantic import ValidationError

from hmcs.bus.messages import MESSAGES, Envelope, Message
from hmcs.bus.schemas import wire_schema
from hmcs.bus.wire import schema_of

M = TypeVar("M", bound=Message)
Fields = dict[str, Any]
"""Of a message, envelope and body, as JSON has them."""

BY_SCHEMA: dict[str, type[Message]] = {schema_of(message): message for message in MESSAGES}
"""Every message of this version of the contract by its name on the wire."""


class NoMessageError(ValueError):
    """Something that is no message of this contract; says why."""


def fields_of(payload: bytes) -> Fields:
    """Return the fields of a message as it came over the wire, arrays as lists of numbers.

    Raises NoMessageError where it is no map with a schema of this contract and a source.
    """
    try:
        fields = msgpack.unpackb(payload)
    except (ValueError, msgpack.UnpackException, RecursionError) as error:
        raise NoMessageError(f"not a msgpack message: {error or type(error).__name__}") from error
    schema = fields.get("schema") if isinstance(fields, dict) else None
    if schema not in BY_SCHEMA:
        raise NoMessageError(f"schema {str(schema)[:64]!r} is none of this contract")
    source, seq = fields.get("source"), fields.get("seq")
    if not isinstance(source, dict) or "boot" not in source or not isinstance(seq, int):
        raise NoMessageError(f"{schema}: has no source or no number")
    try:
        return {name: _plain(value) for name, value in fields.items()}
    except (ValueError, TypeError, KeyError) as error:
        raise NoMessageError(f"{schema}: {error}") from error


def message_of(message_type: type[M], text: str | bytes) -> tuple[Envelope, M]:
    """Return envelope and body of a message as it stands in a recording.

    Raises NoMessageError where it is not of that type.
    """
    try:
        return Envelope.model_validate_json(text), message_type.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise NoMessageError(f"{schema_of(message_type)}: {where}: {first['msg']}") from error


def json_schema_of(message_type: type[Message]) -> dict[str, Any]:
    """Return the JSON Schema of a message in a recording: arrays are lists of numbers."""
    schema = _with_lists(wire_schema(message_type))
    assert isinstance(schema, dict)
    return schema


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        data = value.get("data")
        if isinstance(data, bytes):
            return np.frombuffer(data, value["dtype"]).reshape(value["shape"]).tolist()
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, list):
        return [_plain(part) for part in value]
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    return value


def _with_lists(schema: Any) -> Any:
    if isinstance(schema, list):
        return [_with_lists(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    properties = schema.get("properties")
    if isinstance(properties, dict) and set(properties) == {"dtype", "shape", "data"}:
        said = {"description": schema["description"]} if "description" in schema else {}
        return {"type": "array", "items": {"type": "number"}, **said}
    return {name: _with_lists(part) for name, part in schema.items()}
