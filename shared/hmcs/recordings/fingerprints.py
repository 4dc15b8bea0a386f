"""By what a recording is known again, whatever its file is called: what its chunks are.

The file may still grow, and may be damaged later, and is the same recording: counted are the heads
of so many chunks, which have their times, sizes and checksums, from the beginning on.
"""

from __future__ import annotations

import hashlib
import os
import re
import zlib
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

from mcap.opcode import Opcode

from hmcs.recordings.mcap_records import Record, RecordFile

_WRITTEN = re.compile(r"the first (\d+) parts of a recording with the fingerprint ([0-9a-f]{16})")
_TIMES_AND_SIZE_BYTES, _HEAD_BYTES = 24, 28


class Fingerprint(NamedTuple):
    """Of the beginning of a recording."""

    parts: int
    """Chunks it is of, and messages outside of chunks."""
    digest: str

    def __str__(self) -> str:
        return f"the first {self.parts} parts of a recording with the fingerprint {self.digest}"


def fingerprint_in(text: str) -> Fingerprint | None:
    """Return the fingerprint written in a text; None where there is none."""
    found = _WRITTEN.search(text)
    return None if found is None else Fingerprint(int(found[1]), found[2])


def fingerprint_of(recording: Path) -> Fingerprint:
    """Return the fingerprint of all there is of a recording now; raises OSError as reading does."""
    return _digest(list(_parts(recording)))


def is_of(fingerprint: Fingerprint, recording: Path) -> bool:
    """Return whether a fingerprint was taken of this recording, when it was as long or shorter.

    Raises OSError as reading does.
    """
    # One of a recording without a message is no sign of another.
    first = list(islice(_parts(recording), max(fingerprint.parts, 1)))
    return _digest(first) == fingerprint


def _digest(parts: list[bytes]) -> Fingerprint:
    return Fingerprint(len(parts), hashlib.blake2b(b"".join(parts), digest_size=8).hexdigest())


def _parts(recording: Path) -> Iterator[bytes]:
    with recording.open("rb") as stream:
        file = RecordFile(stream, os.fstat(stream.fileno()).st_size, None, ())
        for record in file.records():
            if not isinstance(record, Record):
                continue
            if record.opcode == Opcode.CHUNK:
                head = file.read(record.content, record.content + _HEAD_BYTES)
                if not any(head[_TIMES_AND_SIZE_BYTES:]):
                    # Its writer computed no checksum.
                    head += _checksum(file, record)
                yield head
            elif record.opcode == Opcode.MESSAGE:
                yield _checksum(file, record)


def _checksum(file: RecordFile, record: Record) -> bytes:
    crc = 0
    for at in range(record.content, record.end, _READ_BYTES):
        crc = zlib.crc32(file.read(at, min(at + _READ_BYTES, record.end)), crc)
    return crc.to_bytes(4, "little")


_READ_BYTES = 1 << 20
