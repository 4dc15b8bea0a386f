"""Demonstrations: recorded motion, and the CSV files it is kept in.

A file has the header
`time_s,x_m,y_m[,z_m][,qx,qy,qz,qw][,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm][,state]` and a row a sample.
Where there is no `z_m` the motion lies in the plane z = 0; where `state` is empty the sample
carries no label. Orientation and wrench are there with all of their columns or none.
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

from hmcs.arrays import Array
from hmcs.errors import UserError
from hmcs.motion.quaternions import is_unit
from hmcs.plain_numbers import number_in, separator_in

if TYPE_CHECKING:
    from _csv import Reader


_TIME, _AXES, _STATE = "time_s", ("x_m", "y_m", "z_m"), "state"
_QUATERNION = ("qx", "qy", "qz", "qw")
_WRENCH = ("fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm")
_HEADER = f"time_s,x_m,y_m[,z_m][,{','.join(_QUATERNION)}][,{','.join(_WRENCH)}][,state]"


LARGEST_BYTES = 512 * 1024 * 1024
"""Of a file: an hour at 1 kHz with every column. What is read of it takes several times as much."""


class DemonstrationError(UserError):
    """A file that is no demonstration; names the file and the line."""


class Demonstration(NamedTuple):
    """One recorded motion."""

    name: str
    """Where it came from, e.g. its file's name."""
    time_s: Array
    """Shape (T,), rising."""
    positions: Array
    """m, shape (T, 3)."""
    states: tuple[str | None, ...]
    """The task state of each sample, T of them; None where it has no label."""
    orientations: Array | None = None
    """Of the hand, unit quaternions x y z w, shape (T, 4); None where they were not recorded."""
    wrenches: Array | None = None
    """The operator's force, N, then torque, N·m, shape (T, 6); None where not recorded."""

    @property
    def switches(self) -> NDArray[np.bool_]:
        """Whether a sample has another label than the one before it, shape (T,).

        The first sample has one before it without a label.
        """
        before = (None, *self.states)
        return np.array([own != last for own, last in zip(self.states, before, strict=False)])

    @property
    def stretches(self) -> Iterator[tuple[str | None, slice]]:
        """Each label with the samples it lasts for, in their order.

        A stretch ends where the next begins, on the sample that both share.
        """
        edges = [0, *(np.flatnonzero(self.switches[1:]) + 1).tolist()]
        for begin, end in zip(edges, [*edges[1:], len(self.positions)], strict=True):
            yield self.states[begin], slice(begin, min(end + 1, len(self.positions)))

    def cut(self, begin: int, end: int | None) -> Demonstration:
        """Return the samples from `begin` up to `end`, which is not among them."""
        part = slice(begin, end)
        return Demonstration(
            self.name,
            self.time_s[part],
            self.positions[part],
            self.states[part],
            None if self.orientations is None else self.orientations[part],
            None if self.wrenches is None else self.wrenches[part],
        )


def read_csv(path: str | Path) -> Demonstration:
    """Read a demonstration from a CSV file.

    Raises DemonstrationError, naming file and line, when the file cannot be read, is empty, is no
    text, has no header or unknown columns, has a row with too few or too many fields, a number that
    is none or is not finite, a time that does not rise, a quaternion that is no rotation, or fewer
    than two samples.
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
    table = dict(zip(columns, np.array([row.numbers for row in rows]).T, strict=False))
    table.setdefault(_AXES[2], np.zeros(len(rows)))

    def together(names: tuple[str, ...]) -> Array:
        return np.stack([table[name] for name in names], axis=1)

    return Demonstration(
        file.name,
        table[_TIME],
        together(_AXES),
        tuple(row.state for row in rows),
        together(_QUATERNION) if _QUATERNION[0] in table else None,
        together(_WRENCH) if _WRENCH[0] in table else None,
    )


def write_csv(path: str | Path, demonstration: Demonstration) -> None:
    """Write a demonstration as a CSV file that `read_csv` reads back bit by bit.

    The column `state` is written only where a sample has a label, orientations and wrenches only
    where they were recorded. Raises DemonstrationError when the file cannot be written.
    """
    labeled = any(state is not None for state in demonstration.states)
    parts = [
        ((_TIME,), demonstration.time_s[:, None]),
        (_AXES, demonstration.positions),
        (_QUATERNION, demonstration.orientations),
        (_WRENCH, demonstration.wrenches),
    ]
    there = [(names, numbers) for names, numbers in parts if numbers is not None]
    header = [name for names, _ in there for name in names]
    table = np.hstack([numbers for _, numbers in there])
    try:
        with Path(path).open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow([*header, *([_STATE] if labeled else [])])
            for row, state in zip(table.tolist(), demonstration.states, strict=True):
                writer.writerow([*map(repr, row), *([state or ""] if labeled else [])])
    except OSError as error:
        raise DemonstrationError(f"{path}: cannot be written: {error.strerror}") from error


class _Row(NamedTuple):
    numbers: list[float]
    state: str | None


def _text(file: Path) -> str:
    try:
        if file.exists() and not file.is_file():
            raise DemonstrationError(f"{file}: cannot be read: it is no file, expected a CSV file")
        with file.open("rb") as stream:
            data = stream.read(LARGEST_BYTES + 1)
    except OSError as error:
        raise DemonstrationError(
            f"{file}: cannot be read: {error.strerror}; give the path of a CSV file with the "
            f"header {_HEADER}"
        ) from error
    if len(data) > LARGEST_BYTES:
        raise DemonstrationError(
            f"{file}: has more than {LARGEST_BYTES / 1e6:.0f} MB, more than a demonstration has"
        )
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
    axes = _AXES if _AXES[2] in columns else _AXES[:2]
    senses = [sense for sense in (_QUATERNION, _WRENCH) if set(sense) & set(columns)]
    wanted = [_TIME, *axes, *(name for sense in senses for name in sense)]
    if columns in (wanted, [*wanted, _STATE]):
        return columns
    known = {_TIME, *_AXES, *_QUATERNION, *_WRENCH, _STATE}
    strangers = [column for column in columns if column not in known]
    lacking = [name for sense in senses for name in sense if name not in columns]
    if columns[:1] != [_TIME] and _is_numbers(columns):
        what = "the header is missing"
    elif (mark := separator_in(",".join(header))) is not None:
        what = f"the columns are separated by {mark}, separate them by commas"
    elif strangers:
        what = f"unknown column {', '.join(repr(column) for column in strangers)}"
    elif not set(_AXES[:2]) <= set(positions):
        what = f"positions have {len(positions)} dimension(s), expected 2 or 3"
    elif lacking:
        what = f"there is no column {', '.join(repr(column) for column in lacking)}"
    else:
        what = f"the columns are {','.join(columns)!r}"
    raise DemonstrationError(f"{file}:1: {what}; the header must be {_HEADER}")


def _rows(file: Path, reader: Reader, columns: list[str]) -> Iterator[_Row]:
    labeled = columns[-1] == _STATE
    names = columns[: len(columns) - labeled]
    first = names.index(_QUATERNION[0]) if _QUATERNION[0] in names else None
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
        if first is not None and not is_unit(numbers[first : first + 4]):
            raise DemonstrationError(
                f"{where}: {','.join(_QUATERNION)} is {numbers[first : first + 4]}, expected a "
                "rotation: a quaternion of length 1"
            )
        yield _Row(numbers, (fields[-1].strip() or None) if labeled else None)


def _number(where: str, name: str, text: str) -> float:
    try:
        return number_in(text)
    except ValueError as error:
        raise DemonstrationError(f"{where}: {name} is {error}") from None


def _is_numbers(fields: list[str]) -> bool:
    try:
        return bool([number_in(text) for text in fields])
    except ValueError:
        return False
