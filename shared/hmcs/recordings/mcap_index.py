"""The index behind the data of an MCAP file that was ended, as far as it helps to read the data."""

from __future__ import annotations

import struct
import zlib
from array import array
from collections.abc import Mapping, Sequence
from typing import BinaryIO, NamedTuple

from mcap import records as mcap
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from hmcs.recordings.mcap_channels import Channels, Strict, TextBudget
from hmcs.recordings.mcap_chunks import DamageError, records_in
from hmcs.recordings.mcap_records import HEAD_BYTES, MAGIC

LARGEST_INDEX_BYTES = 64 * 1024 * 1024
"""Of an index that is used. One of a million chunks is as large; a file is read without it too."""
_DAMAGED = "its index is damaged, so that nobody can say what else is missing"
_FOOTER = struct.Struct("<BQQQI")
_PLACE: dict[int, int] = {
    Opcode.CHUNK_INDEX: 16,
    Opcode.ATTACHMENT_INDEX: 0,
    Opcode.METADATA_INDEX: 0,
}
"""Where in records of the index the place of what they are of stands."""


class Index(NamedTuple):
    """What an index says."""

    at: int
    """Where it begins."""
    channels: Channels
    places: Sequence[int]
    """Where chunks, attachments and metadata begin, rising."""
    counts: Mapping[int, int]
    """Messages by channel; empty where it does not say."""


def index_of(stream: BinaryIO, size: int, budget: TextBudget) -> Index | None:
    """Return the index of a file of `size` bytes; None where it has none.

    Raises DamageError for one that cannot be used.
    """
    tail = _FOOTER.size + len(MAGIC)
    if size < tail + len(MAGIC):
        return None
    stream.seek(size - tail)
    end = stream.read(tail)
    opcode, length, at, _, crc = _FOOTER.unpack_from(end)
    known_end = (opcode, length, end[_FOOTER.size :]) == (
        Opcode.FOOTER,
        _FOOTER.size - HEAD_BYTES,
        MAGIC,
    )
    if not known_end or at == 0:
        return None
    index_bytes = size - tail - at
    if at < len(MAGIC) or not 0 < index_bytes <= LARGEST_INDEX_BYTES:
        raise DamageError(_DAMAGED)
    stream.seek(at)
    data = stream.read(index_bytes)
    if crc and zlib.crc32(end[: _FOOTER.size - 4], zlib.crc32(data)) != crc:
        raise DamageError(_DAMAGED)
    try:
        return _index(at, data, budget)
    except (DamageError, McapError, struct.error, ValueError, OverflowError) as error:
        raise DamageError(_DAMAGED) from error


def _index(at: int, data: bytes, budget: TextBudget) -> Index:
    channels, places, counts = Channels(budget), array("Q"), {}
    for opcode, begin, end in records_in(data):
        if opcode in _PLACE:
            (place,) = struct.unpack_from("<Q", data, begin + _PLACE[opcode])
            if len(MAGIC) <= place < at:
                places.append(place)
        elif opcode == Opcode.STATISTICS:
            counts = mcap.Statistics.read(Strict(data[begin:end])).channel_message_counts
        else:
            channels.take(opcode, data[begin:end])
    return Index(at, channels, array("Q", sorted(places)), counts)
