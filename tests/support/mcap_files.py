"""Recordings written anew as other programs write MCAP files, and files that were damaged."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer

Rows = list[Message]


def rewritten(
    source: Path,
    target: Path,
    *,
    compression: CompressionType = CompressionType.ZSTD,
    chunk_bytes: int = 4096,
    chunked: bool = True,
    indexed: bool = True,
    checksums: bool = True,
    library: str = "another program",
    order: Callable[[Rows], Iterable[Message]] = iter,
    begin: Callable[[Writer], None] = lambda writer: None,
) -> Path:
    """Write what is in a recording to another file; `begin` may write something ahead of it."""
    with source.open("rb") as stream:
        records = list(StreamReader(stream).records)
    with target.open("wb") as stream:
        writer = Writer(
            stream,
            chunk_size=chunk_bytes,
            compression=compression,
            use_chunking=chunked,
            index_types=IndexType.ALL if indexed else IndexType.NONE,
            repeat_channels=indexed,
            repeat_schemas=indexed,
            use_statistics=indexed,
            use_summary_offsets=indexed,
            enable_crcs=checksums,
        )
        writer.start("", library)
        begin(writer)
        schemas: dict[int, int] = {0: 0}
        channels: dict[int, int] = {}
        for each in records:
            if isinstance(each, Schema) and each.id not in schemas:
                schemas[each.id] = writer.register_schema(each.name, each.encoding, each.data)
            elif isinstance(each, Channel) and each.id not in channels:
                channels[each.id] = writer.register_channel(
                    each.topic, each.message_encoding, schemas[each.schema_id]
                )
        for each in order([each for each in records if isinstance(each, Message)]):
            number = channels[each.channel_id]
            writer.add_message(number, each.log_time, each.data, each.publish_time, each.sequence)
        for each in records:
            if isinstance(each, Metadata):
                writer.add_metadata(each.name, each.metadata)
            elif isinstance(each, Attachment):
                writer.add_attachment(
                    each.create_time, each.log_time, each.name, each.media_type, each.data
                )
        writer.finish()
    return target


def chunks_of(file: Path) -> list[tuple[int, int]]:
    """Return where each chunk of a whole file begins and ends."""
    data, at, found = file.read_bytes(), 8, []
    while True:
        opcode, end = data[at], at + 9 + int.from_bytes(data[at + 1 : at + 9], "little")
        if opcode == 6:
            found.append((at, end))
        if opcode == 15:
            return found
        at = end


def with_bytes(source: Path, target: Path, at: int, changed: bytes, instead_of: int) -> Path:
    """Write a file with some bytes in place of others."""
    data = source.read_bytes()
    target.write_bytes(data[:at] + changed + data[at + instead_of :])
    return target
