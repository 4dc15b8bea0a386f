"""Demonstrations: recorded motion, and the CSV files it is kept in.

A file has the header
`time_s,x_m,y_m[,z_m][,qx,qy,qz,qw][,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm][,state]` and a row a sample.
Where there is no `z_m` the motion lies in the plane z = 0; where `state` is empty the sample
carries no label. Orientation and wrench are there with all of their columns or none. Columns may
stand in any order, in small letters or capitals, with others among them, which are not read; how
they may be separated is in `hmcs.csv_tables`.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterator, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.csv_tables import BadTableError, CsvTable, table_in
from hmcs.errors import UserError
from hmcs.motion.quaternions import is_unit
from hmcs.plain_numbers import number_in

_TIME, _AXES, _STATE = "time_s", ("x_m", "y_m", "z_m"), "state"
_QUATERNION = ("qx", "qy", "qz", "qw")
_WRENCH = ("fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm")
_HEADER = f"time_s,x_m,y_m[,z_m][,{','.join(_QUATERNION)}][,{','.join(_WRENCH)}][,state]"
_KNOWN = {_TIME, *_AXES, *_QUATERNION, *_WRENCH, _STATE}
_NEAR = 0.6
"""How alike the name of a column is to the one it is taken to mean, as `difflib` counts."""

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


class ReadCsv(NamedTuple):
    """A demonstration as it was read."""

    demonstration: Demonstration
    ignored: tuple[str, ...]
    """Names of columns that were not read."""


def read_csv(path: str | Path) -> Demonstration:
    """Read a demonstration from a CSV file.

    Raises DemonstrationError, naming file and line, when the file cannot be read, is empty, is no
    text, has no header, lacks a column or has one that seems to be misspelled, has a row with too
    few or too many fields, a number that is none or is not finite, a time that does not rise, a
    quaternion that is no rotation, or fewer than two samples.
    """
    return read_with_others(path).demonstration


def read_with_others(
    path: str | Path, mapped: Callable[[CsvTable], CsvTable] = lambda table: table
) -> ReadCsv:
    """Read a demonstration as `read_csv` does, with the names of the columns that were not read.

    `mapped` returns a table of other columns as one of those above.
    """
    file = Path(path)
    try:
        table = mapped(table_in(_text(file)))
        columns = _columns(file, table)
        rows = list(_rows(file, table, columns))
    except BadTableError as error:
        raise DemonstrationError(f"{file}:{error.line}: {error}") from error
    if len(rows) < 2:
        raise DemonstrationError(
            f"{file}: {'one sample only' if rows else 'no sample'}, expected two at least below "
            "the header"
        )
    numbers = dict(zip(columns.numbers, np.array([row.numbers for row in rows]).T, strict=True))
    numbers.setdefault(_AXES[2], np.zeros(len(rows)))

    def together(names: tuple[str, ...]) -> Array:
        return np.stack([numbers[name] for name in names], axis=1)

    demonstration = Demonstration(
        file.name,
        numbers[_TIME],
        together(_AXES),
        tuple(row.state for row in rows),
        together(_QUATERNION) if _QUATERNION[0] in numbers else None,
        together(_WRENCH) if _WRENCH[0] in numbers else None,
    )
    return ReadCsv(demonstration, columns.ignored)


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


class _Columns(NamedTuple):
    """Where in a row what stands."""

    numbers: dict[str, int]
    """The column's index by its name."""
    state: int | None
    ignored: tuple[str, ...]
    width: int


def _columns(file: Path, table: CsvTable) -> _Columns:
    names = [name.lower() for name in table.header]
    twice = sorted({name for name in names if name and names.count(name) > 1 and name in _KNOWN})
    strangers = [
        written for written, name in zip(table.header, names, strict=True) if name not in _KNOWN
    ]
    lacking = _lacking(names)
    near = {name: _meant(name, names) for name in strangers}
    misspelled = [f"{name!r} (did you mean {meant!r}?)" for name, meant in near.items() if meant]
    if not {_TIME, *_AXES} & set(names) and _is_numbers(table.header):
        what = "the header is missing"
    elif misspelled:
        what = f"unknown column {', '.join(misspelled)}"
    elif twice:
        what = f"the column {', '.join(map(repr, twice))} is there twice"
    elif lacking:
        what = f"there is no column {', '.join(map(repr, lacking))} in {','.join(table.header)!r}"
        if lacking == [_AXES[1]]:
            what += ": add it, 0 in all rows where the hand does not move that way"
    else:
        where = {name: index for index, name in enumerate(names)}
        wanted = [_TIME, *_AXES, *_QUATERNION, *_WRENCH]
        numbers = {name: where[name] for name in wanted if name in where}
        return _Columns(numbers, where.get(_STATE), tuple(filter(None, strangers)), len(names))
    raise DemonstrationError(f"{file}:{table.header_line}: {what}; the header must be {_HEADER}")


def _lacking(names: Sequence[str]) -> list[str]:
    senses = [sense for sense in (_QUATERNION, _WRENCH) if set(sense) & set(names)]
    wanted = [_TIME, *_AXES[:2], *(name for sense in senses for name in sense)]
    return [name for name in wanted if name not in names]


def _meant(stranger: str, names: Sequence[str]) -> str | None:
    """The known column that is not there and that a stranger seems to be; None for none."""
    missing = [
        name for name in (_TIME, *_AXES, _STATE, *_QUATERNION, *_WRENCH) if name not in names
    ]
    plain = stranger.lower()
    begins = [name for name in missing if plain and name.startswith(f"{plain}_")]
    near = begins or get_close_matches(plain, missing, n=1, cutoff=_NEAR)
    return near[0] if near else None


def _rows(file: Path, table: CsvTable, columns: _Columns) -> Iterator[_Row]:
    rotation = _QUATERNION[0] in columns.numbers
    names = list(columns.numbers)
    first = names.index(_QUATERNION[0]) if rotation else 0
    before_s = -math.inf
    for line, fields in table.rows:
        where = f"{file}:{line}"
        if len(fields) != columns.width:
            hint = (
                ", or its numbers have decimal commas, which need semicolons between columns"
                if table.separator == "," and len(fields) > columns.width
                else ""
            )
            raise DemonstrationError(
                f"{where}: {len(fields)} field(s), expected {columns.width} "
                f"({','.join(table.header)}): the row is incomplete or has too much{hint}"
            )
        numbers = [_number(where, name, table, fields[columns.numbers[name]]) for name in names]
        if numbers[0] <= before_s:
            raise DemonstrationError(
                f"{where}: time_s is {numbers[0]}, expected more than the {before_s} of the row "
                "before: times must rise"
            )
        before_s = numbers[0]
        if rotation and not is_unit(numbers[first : first + 4]):
            raise DemonstrationError(
                f"{where}: {','.join(_QUATERNION)} is {numbers[first : first + 4]}, expected a "
                "rotation: a quaternion of length 1"
            )
        state = None if columns.state is None else fields[columns.state].strip()
        yield _Row(numbers, state or None)


def _number(where: str, name: str, table: CsvTable, text: str) -> float:
    try:
        return table.number(text)
    except ValueError as error:
        raise DemonstrationError(f"{where}: {name} is {error}") from None


def _is_numbers(fields: Sequence[str]) -> bool:
    try:
        return bool([number_in(text) for text in fields])
    except ValueError:
        return False
