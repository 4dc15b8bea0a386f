"""The zip archive that a model file is: its manifest and its arrays, read within bounds.

The origin of a file is unknown, so nothing it declares about itself is trusted before it is checked:

| bound | reason |
|---|---|
| `MOST_BYTES` of the file, and of all that is in it | a hundred gestemes of a thousand phases with all senses take 30 MB |
| `MOST_RATIO` times as large unpacked as packed | zeros that fill up arrays pack well, but not a whole model so well |
| `MOST_ENTRIES`, each name once | an array each, two to three a gesteme beside the recognizer's own |
| `MOST_MANIFEST_BYTES`, `MOST_VALUES`, `DEEPEST` of the JSON | a task of a hundred states takes 100 kB and ten levels |
| arrays of whole or real numbers, as many as their header says | what a header claims is not there until it was read |
"""  # noqa: E501  rows of a table

from __future__ import annotations

import io
import json
import math
import re
import struct
import zipfile
import zlib
from collections.abc import Collection, Iterator
from types import TracebackType
from typing import Any, NoReturn, Self

import numpy as np

from hmcs.recognition.checking import AnyArray

MANIFEST, ARRAYS = "model.json", "arrays/"

MOST_BYTES = 64 * 2**20
MOST_RATIO = 100
SMALL_BYTES = 2**20
"""What is no larger than this unpacked may be packed as well as it likes."""
MOST_ENTRIES = 10_000
MOST_MANIFEST_BYTES = 4 * 2**20
MOST_VALUES = 200_000
DEEPEST = 32
MOST_DIMENSIONS = 8
LARGEST_INTEGER = 2**63

_NPY_BEGIN = b"\x93NUMPY\x01\x00"
_LONGEST_HEADER = 512
_HEADER = re.compile(
    rb"\{'descr': '(?P<kind>[<>|=][fiub][1248])', 'fortran_order': (?P<fortran>True|False), "
    rb"'shape': \((?P<shape>(?:\d{1,12},? ?){0,%d})\), \} *\n" % MOST_DIMENSIONS
)
_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENCRYPTED = 0x1
_DIRECTORY_ENTRY = b"PK\x01\x02"
_DAMAGED = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    LookupError,
    MemoryError,
    OSError,
    OverflowError,
    RuntimeError,
    TypeError,
    ValueError,
)
"""What the standard library raises of archives that are damaged, encrypted or of another kind;
NotImplementedError and RecursionError are RuntimeErrors."""


class ArchiveError(ValueError):
    """No archive of a model, or one that passes a bound; says what is wrong."""


class Archive:
    """A model's archive, opened and counted; nothing of it is unpacked yet."""

    def __init__(self, content: bytes) -> None:
        """Open what a file holds; raises ArchiveError."""
        if content.count(_DIRECTORY_ENTRY) > MOST_ENTRIES:
            raise ArchiveError(f"more than {MOST_ENTRIES:,} entries")
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(content))
        except _DAMAGED as error:
            raise ArchiveError(f"no zip archive, or a truncated one ({error})") from error
        self._entries = {entry.filename: entry for entry in self._zip.infolist()}
        self._check_entries(len(content))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._zip.close()

    def manifest(self) -> Any:
        """Return the JSON of the manifest: text, finite numbers, truth values, lists, mappings.

        Raises ArchiveError.
        """
        raw = self._unpacked(MANIFEST, MOST_MANIFEST_BYTES)
        try:
            read = json.loads(
                raw.decode("utf-8"), object_pairs_hook=_different, parse_constant=_no_number
            )
        except _DAMAGED as error:
            raise ArchiveError(f"{MANIFEST} is no JSON that is read: {error}") from error
        _check_values(read)
        return read

    def arrays(self, required: Collection[str], optional: Collection[str]) -> dict[str, AnyArray]:
        """Return the arrays of these names, those that are optional where they are there.

        Raises ArchiveError, also for an array that is not there, and for any other entry.
        """
        there = {
            name.removeprefix(ARRAYS).removesuffix(".npy")
            for name in self._entries
            if name != MANIFEST
        }
        for name in required:
            if name not in there:
                raise ArchiveError(f"array {name!r} is missing")
        strangers = there - {*required, *optional}
        if strangers:
            raise ArchiveError(f"array {min(strangers)!r:.80} is none of this model")
        return {name: _array(name, self._unpacked(_entry(name), MOST_BYTES)) for name in there}

    def _check_entries(self, packed: int) -> None:
        entries = self._zip.infolist()
        if len(self._entries) != len(entries):
            raise ArchiveError("a name stands twice")
        for entry in entries:
            name = entry.filename
            if name != MANIFEST and not (name.startswith(ARRAYS) and name.endswith(".npy")):
                raise ArchiveError(f"{name!r:.80} is no part of a model")
            if entry.compress_type not in _PACKED or entry.flag_bits & _ENCRYPTED:
                raise ArchiveError(f"{name!r:.80} is packed in a way that is not read")
        total = sum(entry.file_size for entry in entries)
        if total > max(SMALL_BYTES, min(MOST_BYTES, MOST_RATIO * packed)):
            raise ArchiveError(
                f"{total:,} bytes unpacked, expected at most {MOST_BYTES:,}, and {MOST_RATIO} "
                "times those of the file"
            )
        if MANIFEST not in self._entries:
            raise ArchiveError(f"there is no {MANIFEST}")

    def _unpacked(self, name: str, most: int) -> bytes:
        """Return an entry, of which no more is unpacked than it says it has."""
        entry = self._entries[name]
        if entry.file_size > most:
            raise ArchiveError(f"{name} has {entry.file_size:,} bytes, expected at most {most:,}")
        try:
            with self._zip.open(entry) as stream:
                # Reading up to the end checks that it is there, and its checksum.
                content = stream.read(entry.file_size + 1)
        except _DAMAGED as error:
            raise ArchiveError(f"{name} is damaged ({error})") from error
        if len(content) != entry.file_size:
            raise ArchiveError(f"{name} is truncated")
        return content


def _entry(name: str) -> str:
    return f"{ARRAYS}{name}.npy"


def _array(name: str, content: bytes) -> AnyArray:
    """Read an array as numpy writes it, its header checked against what is there."""
    begin = len(_NPY_BEGIN) + 2
    length = int.from_bytes(content[len(_NPY_BEGIN) : begin], "little")
    header = _HEADER.fullmatch(content, begin, begin + min(length, _LONGEST_HEADER))
    if not content.startswith(_NPY_BEGIN) or header is None or len(header[0]) != length:
        raise ArchiveError(f"array {name!r} does not begin as an array of whole or real numbers")
    data = memoryview(content)[begin + length :]
    shape = tuple(int(size) for size in re.findall(rb"\d+", header["shape"]))
    try:
        kind = np.dtype(header["kind"].decode())
        wanted = math.prod(shape) * kind.itemsize
        if wanted != len(data):
            raise ArchiveError(
                f"array {name!r} says it has shape {shape}, but holds {len(data):,} bytes"
            )
        in_fortran_order = header["fortran"] == b"True"
        given = np.ndarray(shape, kind, bytes(data), order="F" if in_fortran_order else "C")
        # A copy may be written to, and lies as its kind wants it.
        return given.copy("K")
    except (TypeError, MemoryError, OverflowError) as error:
        raise ArchiveError(f"array {name!r} cannot be read: {error}") from error


def _different(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ValueError("a key stands twice")
    return found


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text} is no number")


def _check_values(read: Any) -> None:
    """Refuse JSON that is too deep or large, or holds what is no number or no character."""
    for values, (value, depth) in enumerate(_values(read), start=1):
        if depth > DEEPEST:
            raise ArchiveError(f"{MANIFEST} has more than {DEEPEST} levels")
        if values > MOST_VALUES:
            raise ArchiveError(f"{MANIFEST} has more than {MOST_VALUES:,} values")
        if isinstance(value, float) and not math.isfinite(value):
            raise ArchiveError(f"{MANIFEST} holds a number that is not finite")
        if isinstance(value, int) and abs(value) > LARGEST_INTEGER:
            raise ArchiveError(f"{MANIFEST} holds an integer of more than 64 bits")
        if isinstance(value, str) and not value.isascii():
            _check_characters(value)


def _check_characters(text: str) -> None:
    try:
        text.encode("utf-8")
    except UnicodeEncodeError as error:
        raise ArchiveError(f"{MANIFEST} holds half a surrogate pair") from error


def _values(read: Any) -> Iterator[tuple[Any, int]]:
    """Every value with its depth, and every key; not by recursion."""
    waiting = [(read, 1)]
    while waiting:
        value, depth = waiting.pop()
        yield value, depth
        if isinstance(value, dict):
            waiting += [(inner, depth + 1) for inner in (*value, *value.values())]
        elif isinstance(value, list):
            waiting += [(inner, depth + 1) for inner in value]
