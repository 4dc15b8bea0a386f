"""Messages as they stand in a recording: JSON whose numbers are read back bit by bit."""

from __future__ import annotations

import base64
import json
import math
import struct
from typing import Any, TypeVar

import msgpack
import numpy as np
from pydantic import ValidationError

from hmcs.bus.bounds import MOST_FIELDS
from hmcs.bus.messages import MESSAGES, Envelope, Message, RobotState
from hmcs.bus.schemas import wire_schema
from hmcs.bus.wire import RefusedMessageError, decode, schema_of

M = TypeVar("M", bound=Message)
Fields = dict[str, Any]
"""Of a message, envelope and body, as JSON has them."""

BY_SCHEMA: dict[str, type[Message]] = {schema_of(message): message for message in MESSAGES}
"""Every message of this version of the contract by its name on the wire."""
OLDER: dict[str, type[Message]] = {"robot_state/2": RobotState, "robot_state/3": RobotState}
"""Messages of earlier versions that are read as those of today: what was added may be left out."""


class NoMessageError(ValueError):
    """Something that is no message of this contract; says why."""


def fields_of(payload: bytes) -> Fields:
    """Return the fields of a message as it came over the wire, arrays as lists of numbers.

    Optional fields that were left out stay out. What a newer sender says besides is kept as far as
    JSON can have it: numbers that are none become null. Raises NoMessageError where it is no
    message of this contract.
    """
    try:
        decode(payload, _type_in(payload))
        fields = msgpack.unpackb(payload)
        return {name: _plain(value) for name, value in fields.items() if isinstance(name, str)}
    except RefusedMessageError as error:
        raise NoMessageError(str(error)) from error
    except RecursionError as error:
        raise NoMessageError("nested too deeply to be written down") from error


def json_fields(text: str | bytes) -> Fields:
    """Return the fields of a message as it stands in a recording; NoMessageError for no object."""
    try:
        fields = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise NoMessageError(f"not JSON: {error or type(error).__name__}") from error
    if not isinstance(fields, dict):
        raise NoMessageError(f"a {type(fields).__name__}, expected an object of fields")
    return fields


def readable_as(schema: str) -> type[Message] | None:
    """Return the message type that messages of a schema in a recording are read as, if any."""
    return BY_SCHEMA.get(schema) or OLDER.get(schema)


def envelope_of(text: str | bytes) -> Envelope:
    """Return the envelope of a message of any version; NoMessageError where it has none."""
    try:
        return Envelope.model_validate_json(text)
    except ValidationError as error:
        raise NoMessageError(_first_of(error)) from error


def message_of(message_type: type[M], text: str | bytes) -> tuple[Envelope, M]:
    """Return envelope and body of a message as it stands in a recording.

    Raises NoMessageError where it is not of that type.
    """
    try:
        return Envelope.model_validate_json(text), message_type.model_validate_json(text)
    except ValidationError as error:
        raise NoMessageError(f"{schema_of(message_type)}: {_first_of(error)}") from error


def json_schema_of(message_type: type[Message]) -> dict[str, Any]:
    """Return the JSON Schema of a message in a recording: arrays are lists of numbers."""
    schema = _with_lists(wire_schema(message_type))
    assert isinstance(schema, dict)
    return schema


def _type_in(payload: bytes) -> type[Message]:
    """The message type that a payload says it is of."""
    unpacker = msgpack.Unpacker(max_buffer_size=0)
    unpacker.feed(payload)
    schema: object = None
    try:
        for _ in range(min(unpacker.read_map_header(), MOST_FIELDS)):
            if unpacker.unpack() == "schema":
                schema = unpacker.unpack()
                break
            unpacker.skip()
    except (ValueError, TypeError, msgpack.UnpackException, RecursionError) as error:
        reason = str(error) or type(error).__name__
        raise NoMessageError(f"not a msgpack map of fields: {reason}") from error
    message_type = BY_SCHEMA.get(schema) if isinstance(schema, str) else None
    if message_type is None:
        raise NoMessageError(f"schema {str(schema)[:64]!r} is none of this contract")
    return message_type


def _first_of(error: ValidationError) -> str:
    first = error.errors(include_url=False, include_input=False)[0]
    return f"{'.'.join(str(part) for part in first['loc'])}: {first['msg']}"


def _plain(value: Any) -> Any:
    """A value of a message as JSON has it."""
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, list):
        return [_plain(part) for part in value]
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    if isinstance(value, dict):
        array = _array(value)
        if array is not None:
            return array
        return {name: _plain(part) for name, part in value.items() if isinstance(name, str)}
    return str(value)


def _array(value: dict[Any, Any]) -> Any:
    """The numbers of an array as it travels, as nested lists; None where it is none."""
    data, dtype, shape = value.get("data"), value.get("dtype"), value.get("shape")
    if not isinstance(data, bytes):
        return None
    if dtype == "<f8" and shape == [len(data) / 8]:
        # Nearly all arrays are of this kind: it takes a tenth of the time of what is below.
        numbers = list(struct.unpack(f"<{len(data) // 8}d", data))
        return numbers if all(map(math.isfinite, numbers)) else _plain(numbers)
    try:
        array = np.frombuffer(data, dtype).reshape(shape)
    except (ValueError, TypeError, OverflowError):
        return None
    return _plain(array.tolist()) if array.dtype.kind in "biuf" else None


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
