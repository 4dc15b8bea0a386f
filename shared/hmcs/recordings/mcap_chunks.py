"""The messages in a chunk of an MCAP file, unpacked within bounds and checked."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import NamedTuple

import lz4.frame  # type: ignore[import-untyped]
import zstandard
from mcap.opcode import Opcode

LARGEST_CHUNK_BYTES = 64 * 1024 * 1024
"""Of a chunk, packed or unpacked. HMCS writes a quarter of a megabyte, other writers some megabytes
or one message more; the recorder, which reads recordings for the page, has 256 MB in all."""

_HEAD = struct.Struct("<QQQI")
_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")


class DamageError(Exception):
    """A record that cannot be used; says why."""


class Chunk(NamedTuple):
    """What the head of a chunk says of it; nothing of it is checked."""

    first_ns: int
    """Log time of its first message..."""
    last_ns: int
    """...and of its last one."""
    unpacked_bytes: int
    crc: int
    """Of the unpacked bytes; 0 where it was not computed."""
    compression: str
    packed: memoryview


class Message(NamedTuple):
    """Where a message stands in unpacked bytes, and its times."""

    channel: int
    log_ns: int
    captured_ns: int
    begin: int
    end: int


def chunk_of(content: bytes) -> Chunk:
    """Return a chunk by the content of its record, whose parts fill it."""
    first_ns, last_ns, unpacked_bytes, crc = _HEAD.unpack_from(content)
    (named,) = struct.unpack_from("<I", content, _HEAD.size)
    begin = _HEAD.size + 4
    name = content[begin : begin + named].decode("ascii", "replace")
    packed = memoryview(content)[begin + named + 8 :]
    return Chunk(first_ns, last_ns, unpacked_bytes, crc, name, packed)


def unpacked(chunk: Chunk) -> bytes:
    """Return what is in a chunk; `check` tells whether it is what its head says.

    Raises DamageError where it is larger than LARGEST_CHUNK_BYTES, packed in a way unknown here, or
    cannot be unpacked.
    """
    size = chunk.unpacked_bytes
    if max(size, len(chunk.packed)) > LARGEST_CHUNK_BYTES:
        raise DamageError(
            f"a chunk of {max(size, len(chunk.packed)) / 1e6:.0f} MB, more than "
            f"{LARGEST_CHUNK_BYTES / 1e6:.0f} MB"
        )
    try:
        # One byte more than it is said to have tells that it has more.
        match chunk.compression:
            case "":
                data = bytes(chunk.packed)
            case "zstd":
                unpacking = zstandard.ZstdDecompressor(max_window_size=LARGEST_CHUNK_BYTES)
                with unpacking.stream_reader(chunk.packed) as reader:
                    data = reader.read(size + 1)
            case "lz4":
                data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.packed, size + 1)
            case other:
                raise DamageError(f"a chunk packed by {other[:16]!r}, which nobody here can unpack")
    except (zstandard.ZstdError, RuntimeError, EOFError, ValueError) as error:
        raise DamageError(f"a damaged chunk ({error})") from error
    return data


def check(chunk: Chunk, data: bytes) -> None:
    """Raise DamageError where what was unpacked is not what the head of its chunk says."""
    if len(data) != chunk.unpacked_bytes or (chunk.crc and zlib.crc32(data) != chunk.crc):
        raise DamageError("a damaged chunk (its checksum is another)")


def records_in(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, begin and end of the content of each record in unpacked bytes.

    Raises DamageError where they are no records to the end.
    """
    at, size = 0, len(data)
    while at < size:
        if at + _RECORD.size > size:
            raise DamageError("a chunk that ends within a record")
        opcode, length = _RECORD.unpack_from(data, at)
        begin = at + _RECORD.size
        at = begin + length
        if at > size:
            raise DamageError("a chunk that ends within a record")
        yield opcode, begin, at


def message_at(data: bytes, begin: int, end: int) -> Message:
    """Return a message by where its record's content stands; DamageError where it is too short."""
    if end - begin < _MESSAGE.size:
        raise DamageError("a message without its times")
    channel, _, log_ns, captured_ns = _MESSAGE.unpack_from(data, begin)
    return Message(channel, log_ns, captured_ns, begin + _MESSAGE.size, end)


def messages_in(data: bytes) -> Iterator[Message]:
    """Yield the messages in unpacked bytes, passing over other records; raises as `records_in`."""
    for opcode, begin, end in records_in(data):
        if opcode == Opcode.MESSAGE:
            yield message_at(data, begin, end)
