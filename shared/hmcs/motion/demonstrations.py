"""Demonstrations: recorded motion, and the CSV files it is kept in.

A file has the header `time_s,x_m,y_m[,z_m][,state]` and a row a sample. Where there is no `z_m`
the motion lies in the plane z = 0; where `state` is empty the sample carries no label.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.errors import UserError

if TYPE_CHECKING:
    from _csv import Reader

FloatArray = NDArray[np.float64]

_TIME, _AXES, _STATE = "time_s", ("x_m", "y_m", "z_m"), "state"
_HEADER = "time_s,x_m,y_m[,z_m][,state]"


class DemonstrationError(UserError):
    """A file that is no demonstration; names the file and the line."""


class Demonstration(NamedTuple):
    """One recorded motion."""

    name: str
    """Where it came from, e.g. its file's name."""
    time_s: FloatArray
    """Shape (T,), rising."""
    positions: FloatArray
    """m, shape (T, 3)."""
    states: tuple[str | None, ...]
    """The task state of each sample, T of them; None where it has no label."""


def read_csv(path: str | Path) -> Demonstration:
    """Read a demonstration from a CSV file.

    Raises DemonstrationError, naming file and line, when the file cannot be read, is empty, is no
    text, has no header or unknown columns, has a row with too few or too many fields, a number that
    is none or is not finite, a time that does not rise, or fewer than two samples.
    """
    file = Path(path)
    reader = csv.reader(io.StringIO(_text(file), newline=""), strict=True)
    try:
        columns = _columns(file, next(reader, []))
        rows = list(_rows(file, reader, columns))
    except csv.Error as error:
        raise DemonstrationError(f"{file}:{reader.line_num}: not a CSV file: {error}") from error
    if len(rows) < 2:
        raise DemonstrationError(
            f"{file}: {'one sample only' if rows else 'no sample'}, expected two at least below "
            "the header"
        )
    numbers = np.array([row.numbers for row in rows])
    positions = np.zeros((len(rows), 3))
    positions[:, : numbers.shape[1] - 1] = numbers[:, 1:]
    return Demonstration(file.name, numbers[:, 0], positions, tuple(row.state for row in rows))


def write_csv(path: str | Path, demonstration: Demonstration) -> None:
    """Write a demonstration as a CSV file that `read_csv` reads back bit by bit.

    The column `state` is written only where a sample has a label.
    Raises DemonstrationError when the file cannot be written.
    """
    labeled = any(state is not None for state in demonstration.states)
    try:
        with Path(path).open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow([_TIME, *_AXES, *([_STATE] if labeled else [])])
            for time_s, position, state in zip(
                demonstration.time_s, demonstration.positions, demonstration.states, strict=True
            ):
                numbers = [repr(float(number)) for number in (time_s, *position)]
                writer.writerow([*numbers, *([state or ""] if labeled else [])])
    except OSError as error:
        raise DemonstrationError(f"{path}: cannot be written: {error.strerror}") from error


class _Row(NamedTuple):
    numbers: list[float]
    state: str | None


def _text(file: Path) -> str:
    try:
        data = file.read_bytes()
    except OSError as error:
        raise DemonstrationError(
            f"{file}: cannot be read: {error.strerror}; give the path of a CSV file with the "
            f"header {_HEADER}"
        ) from error
    if not data.strip():
        raise DemonstrationError(f"{file}:1: empty, expected the header {_HEADER}")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise DemonstrationError(
            f"{file}:{line}: not UTF-8 text, expected a CSV file with the header {_HEADER}"
        ) from error
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise DemonstrationError(f"{file}:{line}: binary data, expected a CSV file")
    return text


def _columns(file: Path, header: list[str]) -> list[str]:
    columns = [column.strip() for column in header]
    positions = [column for column in columns if column in _AXES]
    labels = [_STATE] if columns[-1:] == [_STATE] else []
    for axes in (_AXES[:2], _AXES):
        if columns == [_TIME, *axes, *labels]:
            return columns
    known = {_TIME, *_AXES, _STATE}
    strangers = [column for column in columns if column not in known]
    if columns[:1] != [_TIME] and _is_numbers(columns):
        what = "the header is missing"
    elif strangers:
        what = f"unknown column {', '.join(repr(column) for column in strangers)}"
    elif not set(_AXES[:2]) <= set(positions):
        what = f"positions have {len(positions)} dimension(s), expected 2 or 3"
    else:
        what = f"the columns are {','.join(columns)!r}"
    raise DemonstrationError(f"{file}:1: {what}; the header must be {_HEADER}")


def _rows(file: Path, reader: Reader, columns: list[str]) -> Iterator[_Row]:
    labeled = columns[-1] == _STATE
    names = columns[: len(columns) - labeled]
    before_s = -math.inf
    for fields in reader:
        if not fields:
            continue
        where = f"{file}:{reader.line_num}"
        if len(fields) != len(columns):
            raise DemonstrationError(
                f"{where}: {len(fields)} field(s), expected {len(columns)} ({','.join(columns)}): "
                "the row is incomplete or has too much"
            )
        numbers = [_number(where, name, text) for name, text in zip(names, fields, strict=False)]
        if numbers[0] <= before_s:
            raise DemonstrationError(
                f"{where}: time_s is {numbers[0]}, expected more than the {before_s} of the row "
                "before: times must rise"
            )
        before_s = numbers[0]
        yield _Row(numbers, (fields[-1].strip() or None) if labeled else None)


def _number(where: str, name: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        raise DemonstrationError(f"{where}: {name} is {text[:32]!r}, expected a number") from None
    if not math.isfinite(number):
        raise DemonstrationError(f"{where}: {name} is {text.strip()}, expected a finite number")
    return number


def _is_numbers(fields: list[str]) -> bool:
    try:
        return bool([float(text) for text in fields])
    except ValueError:
        return False
