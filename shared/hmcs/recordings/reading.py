"""What a recording holds, as far as it can be read: a file that was cut off is read to the cut."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

import zstandard
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, DataEnd, Message, Metadata, Schema
from mcap.stream_reader import CRCValidationError, StreamReader

from hmcs.bus.messages import Envelope
from hmcs.bus.messages import Message as BusMessage
from hmcs.bus.wire import schema_of
from hmcs.errors import UserError
from hmcs.recordings.plain import NoMessageError, message_of

M = TypeVar("M", bound=BusMessage)

HMCS = "hmcs."
"""What schemas of the contract begin with in a recording."""
_BROKEN = (
    McapError,
    CRCValidationError,
    EOFError,
    struct.error,
    zlib.error,
    zstandard.ZstdError,
    ValueError,
    KeyError,
    IndexError,
    OverflowError,
    MemoryError,
)
"""What mcap raises where its file ends in the middle, or is damaged."""
LARGEST_RECORD_BYTES = 256 * 1024 * 1024


class RecordingError(UserError):
    """A recording that cannot be used for what was asked; says why and what to do."""


class Recorded(NamedTuple):
    """One message of a recording."""

    key: str
    schema: str
    """With its version, e.g. `motion/1`."""
    text: bytes
    """JSON of envelope and body."""
    log_ns: int
    """When the recorder got it, ns since 1970."""
    captured_ns: int
    """When the operator's sample that caused it was taken, by the recorder's clock."""

    @property
    def fields(self) -> dict[str, Any]:
        """Envelope and body as JSON has them."""
        loaded = json.loads(self.text)
        assert isinstance(loaded, dict)
        return loaded


@dataclass(frozen=True)
class RecordingContent:
    """What a recording holds."""

    path: Path
    messages: tuple[Recorded, ...]
    """Of the contract, in the order they came."""
    metadata: Mapping[str, Mapping[str, str]]
    attachments: Mapping[str, bytes]
    whole: bool
    """Whether the recorder ended it; else it was cut off, and what came last may be missing."""
    damage: str
    """What stopped the reading; empty where nothing did."""

    @property
    def first_ns(self) -> int:
        """When its first message was logged; 0 where there is none."""
        return self.messages[0].log_ns if self.messages else 0

    @property
    def last_ns(self) -> int:
        """When its last message was logged; 0 where there is none."""
        return self.messages[-1].log_ns if self.messages else 0

    @property
    def duration_s(self) -> float:
        """From the first to the last message."""
        return (self.last_ns - self.first_ns) / 1e9

    def of(self, message_type: type[M]) -> Iterator[tuple[Recorded, Envelope, M]]:
        """Yield the messages of a type.

        Raises RecordingError where they are of another version of the contract.
        """
        for recorded, envelope, message in self.of_any(message_type):
            yield recorded, envelope, cast(M, message)

    def of_any(
        self, *message_types: type[BusMessage]
    ) -> Iterator[tuple[Recorded, Envelope, BusMessage]]:
        """Yield the messages of several types in the order they came; raises as `of` does."""
        types = {schema_of(message_type): message_type for message_type in message_types}
        wanted = {message_type.SCHEMA: schema for schema, message_type in types.items()}
        for recorded in self.messages:
            if recorded.schema in types:
                try:
                    envelope, message = message_of(types[recorded.schema], recorded.text)
                except NoMessageError as error:
                    raise RecordingError(f"{self.path}: {error}: the file is damaged") from error
                yield recorded, envelope, message
            elif (name := recorded.schema.partition("/")[0]) in wanted:
                raise RecordingError(
                    f"{self.path}: has {recorded.schema}, expected {wanted[name]}: it was recorded "
                    f"with version {self.metadata.get('hmcs', {}).get('version', 'unknown')} of "
                    "hmcs; read it with that one"
                )


def read(path: str | Path) -> RecordingContent:
    """Read a recording, as much of it as there is.

    Raises RecordingError where there is no such file, or it is none of MCAP at all.
    """
    file = Path(path)
    messages: list[Recorded] = []
    metadata: dict[str, dict[str, str]] = {}
    attachments: dict[str, bytes] = {}
    whole, damage = False, ""
    try:
        with file.open("rb") as stream:
            for record in _records(stream):
                if isinstance(record, Recorded):
                    messages.append(record)
                elif isinstance(record, Metadata):
                    metadata[record.name] = record.metadata
                elif isinstance(record, Attachment):
                    attachments[record.name] = record.data
                elif isinstance(record, DataEnd):
                    whole = True
                else:
                    damage = record
    except OSError as error:
        raise RecordingError(f"{file}: cannot be read: {error.strerror}") from error
    if damage and not (messages or metadata) and _magic(file) != _MAGIC:
        raise RecordingError(f"{file}: no recording: it does not begin as an MCAP file does")
    return RecordingContent(
        file, tuple(messages), metadata, attachments, whole, "" if whole else damage
    )


_MAGIC = b"\x89MCAP0\r\n"


def _magic(file: Path) -> bytes:
    """What the file begins with; of one that was cut off within, what it was to begin with."""
    with file.open("rb") as stream:
        begun = stream.read(len(_MAGIC))
    return _MAGIC if _MAGIC.startswith(begun) else begun


def _records(stream: Any) -> Iterator[Recorded | Metadata | Attachment | DataEnd | str]:
    """Yield what is read, and at last the damage that ended it."""
    schemas: dict[int, str] = {}
    channels: dict[int, Channel] = {}
    reader = StreamReader(stream, validate_crcs=True, record_size_limit=LARGEST_RECORD_BYTES)
    try:
        for record in reader.records:
            if isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message):
                channel = channels[record.channel_id]
                name = schemas[channel.schema_id]
                if name.startswith(HMCS):
                    yield Recorded(
                        channel.topic,
                        name.removeprefix(HMCS),
                        record.data,
                        record.log_time,
                        record.publish_time,
                    )
            elif isinstance(record, (Metadata, Attachment, DataEnd)):
                yield record
    except _BROKEN as error:
        yield str(error) or type(error).__name__
