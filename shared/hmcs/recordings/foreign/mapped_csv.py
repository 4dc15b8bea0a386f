"""CSV files with columns of other names, units and times, read as those of our own.

A layer over `hmcs.csv_tables`: columns are renamed, numbers scaled. How columns are separated is
not known here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, datetime
from itertools import chain
from pathlib import Path

from hmcs.csv_tables import CsvTable, Row
from hmcs.errors import UserError
from hmcs.motion.demonstrations import DemonstrationError
from hmcs.recordings.foreign.choices import ISO, METERS, SECONDS, Choices
from hmcs.recordings.foreign.columns import FORCE, PLACE, TURN, Column, columns_in, several_units
from hmcs.shown import plain

OWN = {
    "time": "time_s",
    **{axis: f"{axis}_m" for axis in PLACE},
    **{part: part for part in TURN},
    **{part: f"{part}_n" for part in FORCE[:3]},
    **{part: f"{part}_nm" for part in FORCE[3:]},
    "state": "state",
}
"""Names of our own columns by their roles."""
SINCE_1970_S = 1e8
"""Larger times are dates: they count from the first row."""

_LONGEST_NOTE = 4000

Convert = Callable[[str], str]


class Mapped:
    """Tables as our own, and what was taken for what."""

    def __init__(self, file: Path, choices: Choices) -> None:
        self._file, self._choices = file, choices
        self.notes: list[str] = []

    def __call__(self, table: CsvTable) -> CsvTable:
        """Return a table with our own names and units, or as it is where it names none.

        Raises UserError where a chosen column is not there or units differ, DemonstrationError,
        with the line, for a time that is none.
        """
        choices = self._choices
        asked = bool(choices.columns or choices.length or choices.time)
        own = {name.lower() for name in table.header}
        if not table.header or (not asked and {OWN["time"], OWN["x"], OWN["y"]} <= own):
            return table
        where = f"{self._file}:{table.header_line}"
        columns = columns_in(table.header, choices, where)
        problem = several_units(columns)
        if problem and not choices.length:
            raise DemonstrationError(f"{where}: {problem}")
        first = next(table.rows, None)
        rows = table.rows if first is None else chain([first], table.rows)
        length = choices.length or next(iter(self._units(columns, PLACE)), "")
        time = self._time(columns, first)
        complete = {"time", "x", "y"} <= columns.keys() and length and time
        if not complete and not asked:
            if {"time", "x", "y"} <= columns.keys() and not own & set(OWN.values()):
                raise DemonstrationError(_no_units(where, columns, length, time))
            return table._replace(rows=rows)
        missing = [role for role in ("time", "x", "y") if role not in columns]
        if missing:
            raise UserError(
                f"{where}: which column is {missing[0]}? Say by --columns {missing[0]}=NAME; it "
                f"has {', '.join(table.header)}"
            )
        return self._renamed(table._replace(rows=rows), columns, length or "m", time or "s")

    def _units(self, columns: Mapping[str, Column], roles: tuple[str, ...]) -> list[str]:
        units = dict.fromkeys(columns[role].unit for role in roles if role in columns)
        return [unit for unit in units if unit in METERS]

    def _time(self, columns: Mapping[str, Column], first: Row | None) -> str:
        if self._choices.time or "time" not in columns:
            return self._choices.time
        column = columns["time"]
        if column.unit in SECONDS:
            return column.unit
        field = first.fields[column.at] if first and column.at < len(first.fields) else ""
        return ISO if _is_date(field) else ""

    def _renamed(
        self, table: CsvTable, columns: Mapping[str, Column], length: str, time: str
    ) -> CsvTable:
        # Columns without a role have no name that could be taken for another's.
        header = [""] * len(table.header)
        converts = dict[int, Convert]()
        size_m = METERS[length]
        for role, column in columns.items():
            header[column.at] = OWN[role]
            if role in PLACE and size_m != 1.0:
                converts[column.at] = lambda field: _scaled(table, field, size_m)
        converts[columns["time"].at] = _Clock(table, time)
        taken = ", ".join(f"{role}={column.name}" for role, column in columns.items())
        used = {column.at for column in columns.values()}
        others = [name for at, name in enumerate(table.header) if at not in used]
        note = f"{self._file.name}: columns {taken}; positions in {length}, times in {time}"
        if others:
            note += f"; not read: {', '.join(others)}"
        self.notes.append(plain(note, _LONGEST_NOTE))
        return table._replace(header=tuple(header), rows=self._rows(table, converts))

    def _rows(self, table: CsvTable, converts: Mapping[int, Convert]) -> Iterator[Row]:
        for line, fields in table.rows:
            converted = list(fields)
            for index, convert in converts.items():
                if index < len(fields):
                    try:
                        converted[index] = convert(fields[index])
                    except ValueError as error:
                        raise DemonstrationError(f"{self._file}:{line}: {error}") from error
            yield Row(line, converted)


class _Clock:
    """Seconds of times in one unit, since the first where that is a date."""

    def __init__(self, table: CsvTable, unit: str) -> None:
        self._table, self._unit = table, unit
        self._first_ns: int | None = None

    def __call__(self, field: str) -> str:
        ns = self._ns(field)
        if self._first_ns is None:
            self._first_ns = ns if abs(ns) > SINCE_1970_S * 1e9 else 0
        return repr((ns - self._first_ns) / 1e9)

    def _ns(self, field: str) -> int:
        if self._unit == ISO:
            return _date_ns(field)
        text = field.strip()
        if self._unit == "ns" and text.lstrip("-").isascii() and text.lstrip("-").isdigit():
            return int(text[:30])
        value = self._table.number(field) * SECONDS[self._unit] * 1e9
        if not math.isfinite(value):
            raise ValueError(f"time is {field!r}, expected a finite number")
        return round(value)


def _no_units(where: str, columns: Mapping[str, Column], length: str, time: str) -> str:
    named = ", ".join(columns[role].name for role in ("time", "x", "y"))
    says = " ".join([*([] if length else ["--unit m|mm|…"]), *([] if time else ["--time s|ms|…"])])
    return (
        f"{where}: {named} seem to be time, x and y, in units that the header does not tell: say "
        f"them by {says}, or name the columns time_s,x_m,y_m"
    )


def _scaled(table: CsvTable, field: str, size_m: float) -> str:
    return repr(table.number(field) * size_m)


def _is_date(field: str) -> bool:
    try:
        return "-" in field.strip()[1:] and _date_ns(field) is not None
    except ValueError:
        return False


def _date_ns(field: str) -> int:
    text = field.strip()
    try:
        date = datetime.fromisoformat(text)
    except ValueError:
        raise ValueError(
            f"time is {text[:40]!r}, expected a date as in 2026-03-01T12:00:00.250"
        ) from None
    since = (date if date.tzinfo else date.replace(tzinfo=UTC)) - datetime(1970, 1, 1, tzinfo=UTC)
    return ((since.days * 86_400 + since.seconds) * 1_000_000 + since.microseconds) * 1000
