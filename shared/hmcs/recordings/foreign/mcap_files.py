"""MCAP files of other programs: messages of ROS, JSON or Protobuf with a position in it.

Read within the same bounds as recordings of our own.
"""

from __future__ import annotations

import json
import os
import struct
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap import records as mcap
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from hmcs.recordings.foreign.logs import Message, Topic
from hmcs.recordings.foreign.protobuf_messages import protobuf_fields
from hmcs.recordings.foreign.ros_types import LARGEST_MESSAGE_BYTES, decoded, modern_name
from hmcs.recordings.foreign.said import POSES, Kind, NoSampleError, Said, kind_of, said_in_json
from hmcs.recordings.foreign.tracks import LATEST_NS
from hmcs.recordings.mcap_channels import Channel, Channels, Strict, TextBudget
from hmcs.recordings.mcap_chunks import (
    LARGEST_CHUNK_BYTES,
    DamageError,
    check,
    chunk_of,
    message_at,
    records_in,
    unpacked,
)
from hmcs.recordings.mcap_records import MAGIC, OF_INDEX, Cut, Record, RecordFile
from hmcs.recordings.reading import RecordingError
from hmcs.recordings.scanning import EXPANSION_SLACK_BYTES, MOST_EXPANSION

_ROS = {"cdr": False, "ros1": True}
"""Encodings of messages of ROS, and whether it is ROS 1."""
_JSON, _PROTOBUF = "json", "protobuf"
_CHUNK_HEAD_BYTES = 128


class _Raw(NamedTuple):
    channel: Channel
    log_ns: int
    data: bytes
    description: bytes
    """Of the type of a message of Protobuf."""


class McapLog(NamedTuple):
    """An MCAP file."""

    where: Path

    def topics(self) -> Sequence[Topic]:
        """Return its topics; RecordingError where the file is damaged."""
        counts, kinds = Counter[Channel](), dict[Channel, Kind | None]()
        for raw in self._messages(None):
            counts[raw.channel] += 1
            if raw.channel not in kinds:
                kinds[raw.channel] = _kind(raw)
        return [
            Topic(each.topic, _type_name(each), kinds[each], count)
            for each, count in counts.items()
        ]

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages on some topics as they stand in the file.

        Raises RecordingError where one of them is none of its type.
        """
        for number, raw in enumerate(self._messages(topics), start=1):
            where = f"{self.where}: {raw.channel.topic}"
            try:
                said = _said(where, raw)
            except NoSampleError as error:
                raise RecordingError(f"{where}: message {number} {error}") from error
            yield Message(raw.channel.topic, raw.log_ns, said)

    def _messages(self, topics: Collection[str] | None) -> Iterator[_Raw]:
        try:
            with self.where.open("rb") as stream:
                size = os.fstat(stream.fileno()).st_size
                if stream.read(len(MAGIC)) != MAGIC:
                    raise RecordingError(
                        f"{self.where}: does not begin as an MCAP file does: was it copied whole?"
                    )
                yield from _raw_messages(stream, size, topics)
        except (DamageError, struct.error, IndexError) as error:
            raise RecordingError(
                f"{self.where}: is damaged: {error}: mend it by: mcap recover"
            ) from error


def _raw_messages(stream: BinaryIO, size: int, topics: Collection[str] | None) -> Iterator[_Raw]:
    budget, file = TextBudget(), RecordFile(stream, size, None, ())
    channels, types = Channels(budget), _Types(budget)
    left = size * MOST_EXPANSION + EXPANSION_SLACK_BYTES
    for record in file.records():
        if isinstance(record, Cut):
            raise DamageError(f"it ends at byte {record.at:,}, where its writer was cut off")
        if not isinstance(record, Record):
            raise DamageError(f"no record can be read at byte {record.at:,}")
        if record.opcode == Opcode.DATA_END or record.opcode in OF_INDEX:
            return
        if record.opcode == Opcode.CHUNK:
            if record.end - record.content > LARGEST_CHUNK_BYTES + _CHUNK_HEAD_BYTES:
                raise DamageError(f"a chunk of more than {LARGEST_CHUNK_BYTES / 1e6:.0f} MB")
            chunk = chunk_of(file.read(record.content, record.end))
            left -= chunk.unpacked_bytes
            if left < 0:
                raise DamageError(f"more than {MOST_EXPANSION} times what it has, unpacked")
            data = unpacked(chunk)
            check(chunk, data)
            for opcode, begin, end in records_in(data):
                yield from _taken(channels, types, opcode, data, begin, end, topics)
        elif record.opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
            if record.end - record.content > LARGEST_CHUNK_BYTES:
                raise DamageError(f"a record of more than {LARGEST_CHUNK_BYTES / 1e6:.0f} MB")
            data = file.read(record.content, record.end)
            yield from _taken(channels, types, record.opcode, data, 0, len(data), topics)


class _Types:
    """Descriptions of types of Protobuf, by their names."""

    def __init__(self, budget: TextBudget) -> None:
        self._budget = budget
        self.by_name: dict[str, bytes] = {}

    def take(self, record: bytes) -> None:
        """Take in the record of a schema, if it is of Protobuf; DamageError where it is none."""
        try:
            schema = mcap.Schema.read(Strict(record))
        except (McapError, ValueError, OverflowError) as error:
            raise DamageError(f"a damaged schema ({error})") from error
        if schema.encoding == _PROTOBUF and schema.name not in self.by_name:
            self._budget.hold(schema.name, schema.data.decode("latin-1"))
            self.by_name[schema.name] = schema.data


def _taken(
    channels: Channels,
    types: _Types,
    opcode: int,
    data: bytes,
    begin: int,
    end: int,
    topics: Collection[str] | None,
) -> Iterator[_Raw]:
    """The message in a record, if it is one on these topics; channels are noted."""
    if opcode != Opcode.MESSAGE:
        channels.take(opcode, data[begin:end])
        if opcode == Opcode.SCHEMA:
            types.take(data[begin:end])
        return
    message = message_at(data, begin, end)
    channel = channels.get(message.channel)
    if channel is None:
        raise DamageError("a message on a channel that nothing describes")
    if message.log_ns > LATEST_NS:
        raise DamageError(f"a message on {channel.topic[:80]!r} of no possible time")
    if topics is None or channel.topic in topics:
        description = types.by_name.get(channel.schema, b"")
        yield _Raw(channel, message.log_ns, data[message.begin : message.end], description)


def _type_name(channel: Channel) -> str:
    if channel.encoding in _ROS:
        return modern_name(channel.schema)
    return f"{channel.schema or 'without a schema'}, {channel.encoding}"


def _kind(raw: _Raw) -> Kind | None:
    """What a channel's messages say: by their type in ROS, else by the first of them."""
    if raw.channel.encoding in _ROS:
        return kind_of(modern_name(raw.channel.schema))
    if raw.channel.encoding not in (_JSON, _PROTOBUF):
        return None
    try:
        _said("", raw)
    except NoSampleError:
        return None
    return POSES


def _said(where: str, raw: _Raw) -> Said:
    encoding = raw.channel.encoding
    if encoding in _ROS:
        name = modern_name(raw.channel.schema)
        return decoded(where, name, raw.data, ros1=_ROS[encoding])
    if len(raw.data) > LARGEST_MESSAGE_BYTES:
        raise NoSampleError(f"has {len(raw.data) / 1e6:.0f} MB, which no pose has")
    if encoding == _PROTOBUF:
        return said_in_json(protobuf_fields(raw.channel.schema, raw.description, raw.data))
    try:
        fields = json.loads(raw.data)
    except (ValueError, RecursionError) as error:
        raise NoSampleError("is no JSON") from error
    if not isinstance(fields, dict):
        raise NoSampleError("is no JSON object")
    return said_in_json(fields)
