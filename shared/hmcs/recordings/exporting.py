"""Recordings as tables: a CSV file, or a file of NumPy arrays, for every channel.

A recording may be larger than the memory: it is gone over once to find the columns, and again to
write them, as many at a time as can be held.
"""

from __future__ import annotations

import csv
import re
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hmcs.recordings.foxglove_layout import LAYOUT_NAME
from hmcs.recordings.json_codec import NoMessageError
from hmcs.recordings.reading import Recorded, RecordingContent, RecordingError
from hmcs.whole_files import written_whole

Format = Literal["csv", "npz"]
MOST_COLUMNS = 200_000
"""Of all tables. A robot's state has some fifty; evidence of a hundred gestemes for three hundred
steps has 120 000."""
MOST_HELD_BYTES = 64 * 1024 * 1024
"""Of columns for a NumPy file at a time; for the others the recording is gone over again."""
LARGEST_COLUMN_BYTES = 256 * 1024 * 1024
"""In a NumPy file, where each text has the room of the longest one."""
MOST_FILES = 64
"""Written at a time; systems admit some hundred open ones."""
LONGEST_NAME = 100
"""Characters of a file's name ahead of its number and ending; file systems have 255 bytes."""
_ROBOT = ".urdf"
_ENVELOPE = ("schema",)
_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9._-]")
_LARGEST_NUMBER = 1e308

Row = Mapping[str, Any]


@dataclass
class _Table:
    """What was found of the table of one channel."""

    rows: int = 0
    columns: dict[str, int] = field(default_factory=dict)
    """In their order; the length of the longest text in each, 0 where all are numbers."""

    def bytes_of(self, column: str) -> int:
        """What a column has as an array."""
        return self.rows * max(8, 4 * self.columns[column])


def export(content: RecordingContent, folder: Path, form: Format) -> list[Path]:
    """Write a file for every channel into `folder`; return which.

    Each row is a message: `time_s` since the first message, then its fields, arrays spread over
    columns `name_0`, `name_1`, …. Where an array's length changes, missing places are empty in CSV
    and NaN in NumPy files. The robots' descriptions and the layout for Foxglove that are attached
    are written beside them. Messages that are no JSON are left out. Raises RecordingError where a
    table would be too large, and OSError as writing does; files are there whole or not at all.
    """
    tables = _tables(content)
    folder.mkdir(parents=True, exist_ok=True)
    # Ahead of the name of its channel each key has three parts that all keys of its cell have.
    names = _file_names(["_".join(key.split("/")[3:]) or key for key in sorted(tables)])
    files = {
        key: folder / f"{name}.{form}" for key, name in zip(sorted(tables), names, strict=True)
    }
    if form == "csv":
        keys = iter(files)
        while some := list(islice(keys, MOST_FILES)):
            _write_csv(content, {key: files[key] for key in some}, tables)
    else:
        for key, file in files.items():
            _write_arrays(content, key, file, tables[key])
    return [*files.values(), *_for_viewers(content, folder)]


def _for_viewers(content: RecordingContent, folder: Path) -> Iterator[Path]:
    """Write what is attached for viewers, which read no attachments; yield which files."""
    wanted = [name for name in content.attachments if _is_for_viewers(name)]
    for name in sorted(wanted):
        file = folder / _NOT_IN_NAMES.sub("_", name)[-LONGEST_NAME:]
        with written_whole(file) as unfinished:
            unfinished.write_bytes(content.attachments[name])
        yield file


def _is_for_viewers(name: str) -> bool:
    return name == LAYOUT_NAME or name.endswith(_ROBOT)


def _tables(content: RecordingContent) -> dict[str, _Table]:
    tables: dict[str, _Table] = {}
    count = 0
    for key, row in _rows(content):
        table = tables.setdefault(key, _Table())
        table.rows += 1
        before = len(table.columns)
        for name, value in row.items():
            longest = table.columns.setdefault(name, 0)
            if isinstance(value, str):
                table.columns[name] = max(longest, len(value), 1)
        count += len(table.columns) - before
        if count > MOST_COLUMNS:
            raise RecordingError(
                f"{content.path}: its tables have more than {MOST_COLUMNS} columns"
            )
    return tables


def _rows(content: RecordingContent, key: str | None = None) -> Iterator[tuple[str, Row]]:
    """Each message as a row, of one key or of all."""
    for message in content.messages:
        if key in (None, message.key) and (row := _row(message, content.first_ns)) is not None:
            yield message.key, row


def _row(message: Recorded, first_ns: int) -> Row | None:
    try:
        fields = message.fields
    except NoMessageError:
        return None
    body = {name: value for name, value in fields.items() if name not in _ENVELOPE}
    return {"time_s": (message.log_ns - first_ns) / 1e9, **dict(_flat(body))}


def _flat(fields: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in fields.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}_")
        elif isinstance(value, list):
            yield from _flat({str(k): part for k, part in enumerate(value)}, f"{prefix}{name}_")
        elif value is None or isinstance(value, str | float) or abs(value) < _LARGEST_NUMBER:
            yield f"{prefix}{name}", value
        else:
            yield f"{prefix}{name}", str(value)


def _file_names(wanted: Sequence[str]) -> Iterator[str]:
    """Yield a file's name for each name, each another one.

    The names stand in a file of somebody's: only letters, digits and `._-` are taken of them.
    """
    taken: set[str] = set()
    for each in wanted:
        base = _NOT_IN_NAMES.sub("_", each).strip(".")[:LONGEST_NAME] or "unnamed"
        name, number = base, 1
        # Some file systems do not tell capitals from small letters.
        while name.lower() in taken:
            number += 1
            name = f"{base}-{number}"
        taken.add(name.lower())
        yield name


def _write_csv(
    content: RecordingContent, files: Mapping[str, Path], tables: Mapping[str, _Table]
) -> None:
    with ExitStack() as stack:
        writers = {}
        for key, file in files.items():
            unfinished = stack.enter_context(written_whole(file))
            stream = stack.enter_context(unfinished.open("w", encoding="utf-8", newline=""))
            columns = list(tables[key].columns)
            writers[key] = csv.DictWriter(stream, columns, restval="", lineterminator="\n")
            writers[key].writeheader()
        for key, row in _rows(content):
            if key in writers:
                writers[key].writerow(row)


def _write_arrays(content: RecordingContent, key: str, file: Path, table: _Table) -> None:
    for column in table.columns:
        if table.bytes_of(column) > LARGEST_COLUMN_BYTES:
            raise RecordingError(
                f"{content.path}: the texts in column {column[:64]!r} of {key} are too long for "
                "NumPy arrays: export it as CSV"
            )
    with (
        written_whole(file) as unfinished,
        zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        names = _file_names(list(table.columns))
        for columns in _held_together(table):
            for array in _arrays(content, key, table, columns):
                with archive.open(f"{next(names)}.npy", "w", force_zip64=True) as stream:
                    np.save(stream, array, allow_pickle=False)


def _held_together(table: _Table) -> Iterator[list[str]]:
    """The columns in parts that can be held at a time."""
    part: list[str] = []
    room = MOST_HELD_BYTES
    for column in table.columns:
        if part and table.bytes_of(column) > room:
            yield part
            part, room = [], MOST_HELD_BYTES
        part.append(column)
        room -= table.bytes_of(column)
    yield part


def _arrays(
    content: RecordingContent, key: str, table: _Table, columns: Sequence[str]
) -> list[NDArray[Any]]:
    """Some columns, in their order."""
    texts = [table.columns[name] for name in columns]
    arrays: list[NDArray[Any]] = [
        np.zeros(table.rows, f"<U{longest}") if longest else np.full(table.rows, np.nan)
        for longest in texts
    ]
    for number, (_, row) in enumerate(_rows(content, key)):
        for name, array, longest in zip(columns, arrays, texts, strict=True):
            value = row.get(name)
            if value is not None:
                array[number] = str(value) if longest else value
    return arrays
