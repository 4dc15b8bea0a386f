"""MCAP files record by record: where each one stands, and where a damaged file goes on.

The format is described at https://mcap.dev/spec: after eight bytes of magic there is one record
after another, each an opcode, a length and that many bytes. `DataEnd` ends the data, and an index
may follow it. The `mcap` library parses the content of records and expects a file that is whole;
here records are found in a file that is not. No length is believed before it was checked: it may be
damaged, or a lie.
"""

from __future__ import annotations

import re
import struct
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from typing import BinaryIO, NamedTuple

from mcap.opcode import Opcode

MAGIC = b"\x89MCAP0\r\n"
"""What the file begins with, and ends with where it is whole."""
HEAD_BYTES = 9
"""Opcode and length of a record."""
CHAIN = 3
"""So many records in a row that fit their own lengths are no accident: after damage the file goes
on with the first of them."""
MOST_TRIES = 100_000
"""At most so many places are tried where a file might go on after damage. A file that was made to
do harm could offer one for every few of its bytes; so many take some seconds."""

_HEAD = struct.Struct("<BQ")
_SEARCH_BYTES = 1 << 20
_LEAST_MESSAGE_BYTES = 22
_LAYOUTS: dict[int, tuple[int | str, ...]] = {
    Opcode.HEADER: ("I", "I"),
    Opcode.SCHEMA: (2, "I", "I", "I"),
    Opcode.CHANNEL: (4, "I", "I", "I"),
    Opcode.CHUNK: (28, "I", "Q"),
    Opcode.MESSAGE_INDEX: (2, "I"),
    Opcode.ATTACHMENT: (16, "I", "I", "Q", 4),
    Opcode.METADATA: ("I", "I"),
    Opcode.DATA_END: (4,),
    Opcode.FOOTER: (20,),
    Opcode.CHUNK_INDEX: (32, "I", 8, "I", 16),
    Opcode.ATTACHMENT_INDEX: (40, "I", "I"),
    Opcode.STATISTICS: (42, "I"),
    Opcode.METADATA_INDEX: (16, "I"),
    Opcode.SUMMARY_OFFSET: (17,),
}
"""What each kind of record is made of: so many bytes, or a count of 4 (I) or 8 (Q) bytes and as
many bytes as it says. A message has no such parts."""
OF_INDEX = frozenset(
    {
        Opcode.FOOTER,
        Opcode.CHUNK_INDEX,
        Opcode.ATTACHMENT_INDEX,
        Opcode.STATISTICS,
        Opcode.METADATA_INDEX,
        Opcode.SUMMARY_OFFSET,
    }
)
"""Kinds of records that stand behind the data only."""
_KNOWN = frozenset({*_LAYOUTS, Opcode.MESSAGE})
_COUNT_BYTES = {"I": 4, "Q": 8}
_IN_CHUNKS = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
_BESIDE_CHUNKS = (Opcode.MESSAGE_INDEX, Opcode.ATTACHMENT, Opcode.METADATA, Opcode.DATA_END)


def _candidate(*opcodes: int) -> re.Pattern[bytes]:
    """One of some opcodes and a length below 4 GiB; matches may overlap."""
    return re.compile(rb"(?=[%s].{4}\0{4})." % re.escape(bytes(opcodes)), re.DOTALL)


_CHUNKS = _candidate(Opcode.CHUNK)
_IN_FILE_OF_CHUNKS = _candidate(Opcode.CHUNK, *_BESIDE_CHUNKS)
_IN_FILE_WITHOUT = _candidate(*_IN_CHUNKS, *_BESIDE_CHUNKS)


class Record(NamedTuple):
    """Where a record stands in its file, in bytes."""

    opcode: int
    at: int
    """Its first byte."""
    end: int
    """The first byte after it."""

    @property
    def content(self) -> int:
        """Where its content begins."""
        return self.at + HEAD_BYTES


class Torn(NamedTuple):
    """A part of a file in which no record can be read."""

    at: int
    end: int
    """Where the file goes on."""


class Cut(NamedTuple):
    """Where a file ends that was not ended by its writer."""

    at: int


class RecordFile:
    """An open file as a row of records."""

    def __init__(self, stream: BinaryIO, size: int, index_at: int | None, known: Sequence[int]):
        """Look at the first `size` bytes of `stream`.

        An index begins at `index_at`, and says that records begin at the places `known`, rising;
        None where the file has no index that can be used.
        """
        self._stream, self._size = stream, size
        self._indexed = index_at is not None
        self._end = size if index_at is None else index_at
        self._known = known
        self._chunked: bool | None = None
        """Whether the file has chunks; None until it is known."""
        self._tries = MOST_TRIES
        self._search_from = len(MAGIC)

    def read(self, begin: int, end: int) -> bytes:
        """Return the bytes from `begin` up to `end`, fewer where the file ends before."""
        self._stream.seek(begin)
        return self._stream.read(max(0, min(end, self._size) - begin))

    def records(self) -> Iterator[Record | Torn | Cut]:
        """Yield the records of the data in order, and between them what is torn.

        Ends after `DataEnd` or the first record of an index, or with a Cut.
        """
        at = self._search_from = len(MAGIC)
        while at < self._end:
            record = self._record_at(at)
            if record is not None and self._is_whole(record):
                # Where nothing whole follows it, its length may be wrong as well, and what follows
                # lie within it. Within chunks and attachments there are records of their own.
                inside = record.opcode in (Opcode.CHUNK, Opcode.ATTACHMENT)
                self._search_from = record.end if inside else at + 1
                if record.opcode == Opcode.CHUNK:
                    self._chunked = True
                yield record
                if record.opcode == Opcode.DATA_END or record.opcode in OF_INDEX:
                    return
                at = record.end
                continue
            cut = record is not None and not self._indexed and self._is_cut(record)
            found = None if cut else self._next_whole(self._search_from)
            if found is None:
                yield Torn(at, self._end) if self._indexed else Cut(at)
                return
            yield Torn(min(at, found), found)
            at = self._search_from = found
        if not self._indexed:
            yield Cut(self._end)

    def doubt(self, record: Record) -> None:
        """Note that the record yielded last is damaged: what follows it may lie within it."""
        self._search_from = record.at + 1

    def _record_at(self, at: int) -> Record | None:
        head = self.read(at, at + HEAD_BYTES)
        if len(head) < HEAD_BYTES:
            return None
        opcode, length = _HEAD.unpack(head)
        return Record(opcode, at, at + HEAD_BYTES + length)

    def _is_whole(self, record: Record) -> bool:
        """Whether all of a record is there and its parts fill it; what is unknown needs another
        record, or the end, behind it."""
        if record.end > (self._size if record.opcode in OF_INDEX else self._end):
            return False
        if record.opcode in _KNOWN:
            return self._fits(record)
        behind = self._record_at(record.end)
        return record.opcode > 0 and (
            record.end == self._end
            or (behind is not None and behind.opcode in _KNOWN and self._is_whole(behind))
        )

    def _is_cut(self, record: Record) -> bool:
        """Whether the file ends within a record whose parts would fill it, by all their counts."""
        return record.end > self._size and record.opcode in _LAYOUTS and self._fits(record)

    def _fits(self, record: Record) -> bool:
        """Whether the parts of a record fill it; not where one's count is not there."""
        if record.opcode == Opcode.MESSAGE:
            return record.end - record.content >= _LEAST_MESSAGE_BYTES
        at = record.content
        for part in _LAYOUTS[record.opcode]:
            if isinstance(part, str):
                count = self.read(at, at + _COUNT_BYTES[part])
                if len(count) < _COUNT_BYTES[part]:
                    return False
                at += len(count) + int.from_bytes(count, "little")
            else:
                at += part
            if at > record.end:
                return False
        return at == record.end

    def _next_whole(self, begin: int) -> int | None:
        """Where the next record begins after `begin`: found in the bytes, else by the index.

        Messages are looked for only where the file has no chunks: those in a chunk that is damaged
        could not be checked.
        """
        known = self._next_known(begin)
        end = self._end if known is None else known
        if self._chunked is None:
            self._chunked = self._search(_CHUNKS, begin, self._end) is not None
        wanted = _IN_FILE_OF_CHUNKS if self._chunked else _IN_FILE_WITHOUT
        found = self._search(wanted, begin, end)
        return known if found is None else found

    def _search(self, wanted: re.Pattern[bytes], begin: int, end: int) -> int | None:
        for at in range(begin, end, _SEARCH_BYTES):
            # A match that begins in this block may end in the next one.
            block = self.read(at, at + _SEARCH_BYTES + HEAD_BYTES)
            for match in wanted.finditer(block):
                place = at + match.start()
                if place >= min(end, at + _SEARCH_BYTES):
                    break
                if not self._may_try():
                    return None
                if self._goes_on(place):
                    return place
        return None

    def _next_known(self, begin: int) -> int | None:
        for index in range(bisect_left(self._known, begin), len(self._known)):
            if not self._may_try():
                return None
            at = self._known[index]
            record = self._record_at(at)
            if record is not None and self._is_whole(record):
                return at
        return None

    def _may_try(self) -> bool:
        self._tries -= 1
        return self._tries >= 0

    def _goes_on(self, at: int) -> bool:
        """Whether a row of whole records begins there."""
        for _ in range(CHAIN):
            record = self._record_at(at) if at < self._end else None
            if record is None:
                return at == self._end
            if record.opcode not in _KNOWN:
                return False
            if not self._is_whole(record):
                return not self._indexed and self._is_cut(record)
            if record.opcode == Opcode.DATA_END or record.opcode in OF_INDEX:
                return True
            at = record.end
        return True
