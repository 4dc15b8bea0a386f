"""Messages of Protobuf in MCAP files, by the description of their type within the file.

That is a `FileDescriptorSet` as https://mcap.dev/spec/registry has it: the file that has the type,
and all that it builds on.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from hmcs.recordings.foreign.libraries import missing
from hmcs.recordings.foreign.said import NoSampleError

DEEPEST = 8
"""Messages within messages that are looked at; a pose has three."""
_TIME = "google.protobuf.Timestamp"


def protobuf_fields(type_name: str, description: bytes, data: bytes) -> Mapping[str, Any]:
    """Return the numbers, words and inner messages of a message, by their names; times as `sec`
    and `nsec`. Lists, bytes and maps, which no pose has, are left out.

    Raises NoSampleError for what is no such message, and MissingLibraryError without `protobuf`.
    """
    try:
        from google.protobuf.message import DecodeError
    except ImportError as error:
        why = "messages of Protobuf are read by protobuf, which is not here"
        raise missing("ros", why) from error
    try:
        message = _type_of(type_name, description).FromString(data)
    except DecodeError as error:
        raise NoSampleError(f"is no {type_name[:80]} of Protobuf") from error
    return _fields_of(message, DEEPEST)


@lru_cache(maxsize=64)
def _type_of(type_name: str, description: bytes) -> Any:
    """The class of a type; raises NoSampleError where it is not described."""
    from google.protobuf.descriptor_pb2 import FileDescriptorSet
    from google.protobuf.descriptor_pool import DescriptorPool
    from google.protobuf.message import DecodeError
    from google.protobuf.message_factory import GetMessageClass

    pool = DescriptorPool()
    try:
        for file in FileDescriptorSet.FromString(description).file:
            pool.Add(file)
        return GetMessageClass(pool.FindMessageTypeByName(type_name))
    # What it raises for a description that fits not together depends on how it was built.
    except (DecodeError, TypeError, KeyError, ValueError) as error:
        raise NoSampleError(f"is of {type_name[:80]}, which its file does not describe") from error


def _fields_of(message: Any, deepest: int) -> Mapping[str, Any]:
    if message.DESCRIPTOR.full_name == _TIME:
        return {"sec": message.seconds, "nsec": message.nanos}
    fields = dict[str, Any]()
    for field in message.DESCRIPTOR.fields:
        if field.is_repeated:
            continue
        if field.message_type is None:
            value = getattr(message, field.name)
            if isinstance(value, int | float | str):
                fields[field.name] = value
        elif deepest and message.HasField(field.name):
            fields[field.name] = _fields_of(getattr(message, field.name), deepest - 1)
    return fields
