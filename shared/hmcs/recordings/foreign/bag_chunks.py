"""Bags of ROS 1, gone over once before a library reads them: are they whole, and what unpacks.

Format: the ROS wiki's `Bags/Format/2.0`. The library unpacks each chunk at one time, however large
it becomes.
"""

from __future__ import annotations

import bz2
import struct
from pathlib import Path
from typing import BinaryIO

import lz4.frame  # type: ignore[import-untyped]

from hmcs.recordings.mcap_chunks import LARGEST_CHUNK_BYTES
from hmcs.recordings.reading import RecordingError

VERSION = b"#ROSBAG V2.0\n"
LARGEST_HEADER_BYTES = 1 << 20
LARGEST_RECORD_BYTES = 256 * 1024 * 1024
"""Of an index; chunks have LARGEST_CHUNK_BYTES."""
_CHUNK = b"\x05"


def check_bag(path: Path) -> None:
    """Raise RecordingError for a bag that ends within a record, or unpacks to too much."""
    size = path.stat().st_size
    with path.open("rb") as stream:
        if stream.read(len(VERSION)) != VERSION:
            raise RecordingError(f"{path}: is no bag of ROS 1 in format 2.0: rosbag migrate it")
        while (at := stream.tell()) < size:
            try:
                _check_record(path, stream, size)
            except (struct.error, EOFError, ValueError) as error:
                raise RecordingError(
                    f"{path}: cannot be read from byte {at:,} of {size:,} on: was its recorder "
                    f"cut off? Mend it by: rosbag reindex {path}"
                ) from error


def _check_record(path: Path, stream: BinaryIO, size: int) -> None:
    fields = _fields(_exactly(stream, _length(stream, LARGEST_HEADER_BYTES)))
    length = _length(stream, LARGEST_RECORD_BYTES)
    end = stream.tell() + length
    if end > size:
        raise EOFError
    if fields.get(b"op") == _CHUNK:
        compression = fields.get(b"compression", b"none")
        if length > LARGEST_CHUNK_BYTES:
            raise _too_large(path)
        if compression != b"none":
            _check_unpacked(path, compression, _exactly(stream, length))
    stream.seek(end)


def _check_unpacked(path: Path, compression: bytes, packed: bytes) -> None:
    """Count what comes out of a chunk; what is no such packing is the library's to say."""
    left = LARGEST_CHUNK_BYTES + 1
    while packed and left > 0:
        unpacking = (
            bz2.BZ2Decompressor() if compression == b"bz2" else lz4.frame.LZ4FrameDecompressor()
        )
        try:
            left -= len(unpacking.decompress(packed, left))
        except (OSError, RuntimeError, EOFError) as error:
            raise ValueError(str(error)) from error
        if not unpacking.eof:
            break
        packed = unpacking.unused_data or b""
    if left <= 0:
        raise _too_large(path)


def _too_large(path: Path) -> RecordingError:
    return RecordingError(
        f"{path}: has a chunk of more than {LARGEST_CHUNK_BYTES / 1e6:.0f} MB: write it anew with "
        "smaller ones: rosbag filter"
    )


def _fields(header: bytes) -> dict[bytes, bytes]:
    found, at = dict[bytes, bytes](), 0
    while at < len(header):
        (length,) = struct.unpack_from("<I", header, at)
        name, _, value = header[at + 4 : at + 4 + length].partition(b"=")
        found[name] = value
        at += 4 + length
    return found


def _length(stream: BinaryIO, most: int) -> int:
    (length,) = struct.unpack("<I", _exactly(stream, 4))
    if length > most:
        raise ValueError("longer than any")
    return int(length)


def _exactly(stream: BinaryIO, length: int) -> bytes:
    data = stream.read(length)
    if len(data) != length:
        raise EOFError
    return data
