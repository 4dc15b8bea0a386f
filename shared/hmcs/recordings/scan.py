"""What stands where in a recording; its messages stay in the file."""

from __future__ import annotations

import struct
from array import array
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode

from hmcs.recordings.gaps import Gap
from hmcs.recordings.mcap_channels import Channel
from hmcs.recordings.mcap_chunks import DamageError, Message, check, chunk_of, unpacked
from hmcs.recordings.mcap_records import HEAD_BYTES, Record, RecordFile

LARGEST_MESSAGE_BYTES = 4 * 1024 * 1024
"""Of the text of one message. Evidence of a hundred gestemes for three hundred steps has 1.5 MB,
and what is read of a text takes up to twenty times as much."""
LATEST_NS = 2**63 - 1
"""Of log times: what NumPy counts in ns since 1970 ends there, in 2262."""
MOST_BLOCKS = 1_000_000
"""Of parts of a file with messages, each noted in 40 bytes. Written every half second, as HMCS
does, so many last six days."""
LONGEST_NAME_BYTES = 4096
"""Of an attachment; no file system has longer ones."""
WRITTEN_AS_IT_CAME = "hmcs "
"""Begins the name of the library that writes messages in the order in which they came. It notes the
steps made before a recording ahead of what came while it asked for them, whose times are earlier.
"""
_MOST_BITS = 62


class Block(NamedTuple):
    """A part of a file with messages of the contract: a chunk, or messages outside of chunks."""

    at: int
    end: int
    first_ns: int
    """The earliest log time in it..."""
    last_ns: int
    """...and the latest."""
    types: int
    """A bit for each message type in it, see `Scan.bit`."""


class Attached(NamedTuple):
    """A file that is kept with a recording."""

    name: str
    at: int
    """Its first byte within the recording."""
    size: int
    record: Record


@dataclass
class Scan:
    """What was found in a file."""

    size: int
    """So many of its bytes were looked at; it may grow meanwhile."""
    library: str = ""
    """Which wrote it."""
    channels: Mapping[int, Channel] = field(default_factory=dict)
    """Those with messages of the contract, by number."""
    counts: Counter[int] = field(default_factory=Counter)
    """Messages of the contract by channel."""
    passed_over: Counter[tuple[str, str]] = field(default_factory=Counter)
    """Messages of the contract that cannot be read, by topic and reason."""
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, Attached] = field(default_factory=dict)
    whole: bool = False
    """Whether its writer ended it."""
    gaps: Sequence[Gap] = ()
    lost: int = 0
    """Messages of the contract that its index counts and that were not found."""
    first_ns: int = 0
    """Log time of the first message of the contract, in the order they are read."""
    last_ns: int = 0
    """The latest one."""
    in_order: bool = True
    """Whether log times never fall, as messages stand in the file."""
    _blocks: tuple[array[int], ...] = field(
        default_factory=lambda: tuple(array("Q") for _ in Block._fields)
    )
    _bits: dict[str, int] = field(default_factory=dict)

    @property
    def as_it_stands(self) -> bool:
        """Whether messages are read in the order in which they stand in the file."""
        return self.in_order or self.library.startswith(WRITTEN_AS_IT_CAME)

    def blocks(self, types: int, *, by_time: bool = False) -> Iterator[Block]:
        """Yield the parts of the file with messages of some types, as they stand in it.

        Or in the order of their earliest log times.
        """
        columns = [np.frombuffer(column, np.uint64) for column in self._blocks]
        chosen = np.flatnonzero(columns[-1] & np.uint64(types))
        if by_time:
            chosen = chosen[np.argsort(columns[2][chosen], kind="stable")]
        for number in chosen.tolist():
            yield Block._make(int(column[number]) for column in columns)

    @property
    def types(self) -> Counter[str]:
        """How many messages there are of each type, by its name with version."""
        found: Counter[str] = Counter()
        for number, count in self.counts.items():
            found[self.channels[number].message_type] += count
        return found

    def bit(self, message_type: str) -> int:
        """Return the bit of a message type in `Block.types`; the last one stands for many."""
        return 1 << self._bits.setdefault(message_type, min(len(self._bits), _MOST_BITS))

    def note(self, block: Block) -> None:
        """Note a block; DamageError where there are too many."""
        if len(self._blocks[0]) >= MOST_BLOCKS:
            raise DamageError(f"more than {MOST_BLOCKS} chunks")
        for column, value in zip(self._blocks, block, strict=True):
            column.append(value)


def why_passed_over(channel: Channel, message: Message, data: bytes) -> str:
    """Return why a message of the contract in unpacked bytes cannot be read; empty where it can."""
    if channel.encoding != "json":
        return f"encoded as {channel.encoding[:16]!r}, not as JSON"
    if message.end - message.begin > LARGEST_MESSAGE_BYTES:
        return f"larger than {LARGEST_MESSAGE_BYTES / 1e6:.0f} MB"
    if message.log_ns > LATEST_NS or message.captured_ns > LATEST_NS:
        return "of a time after the year 2262"
    if data[message.begin : message.begin + 1] + data[message.end - 1 : message.end] != b"{}":
        return "no JSON object"
    return ""


def records_of(file: RecordFile, block: Block) -> bytes:
    """Return the records in a block, unpacked; DamageError as `unpacked` and `check` raise it."""
    data = file.read(block.at, block.end)
    if data[:1] != bytes([Opcode.CHUNK]):
        return data
    chunk = chunk_of(data[HEAD_BYTES:])
    records = unpacked(chunk)
    check(chunk, records)
    return records


def attached_at(file: RecordFile, record: Record) -> Attached:
    """Return the attachment in a record whose parts fill it.

    Raises DamageError where its name is longer than LONGEST_NAME_BYTES, or no text.
    """
    at = record.content + 16
    names = []
    for _ in ("name", "media type"):
        (length,) = struct.unpack("<I", file.read(at, at + 4))
        if length > LONGEST_NAME_BYTES:
            raise DamageError(f"an attachment with a name of {length} bytes")
        names.append(file.read(at + 4, at + 4 + length))
        at += 4 + length
    (size,) = struct.unpack("<Q", file.read(at, at + 8))
    try:
        return Attached(names[0].decode(), at + 8, size, record)
    except UnicodeDecodeError as error:
        raise DamageError(f"an attachment whose name is no text ({error.reason})") from error
