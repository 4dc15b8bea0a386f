"""Tables in text as people and their programs write them: separators, remarks, decimal commas.

Columns are separated by commas, semicolons or tabs, as the header is. A line that begins with # is
a remark; where no other header is there, the last remark above the numbers is it. Beside semicolons
and tabs a number may have a decimal comma.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from typing import NamedTuple

from hmcs.plain_numbers import number_in

REMARK = "#"
_SEPARATORS = ("\t", ";", ",")
_DECIMAL_COMMA = re.compile(r"[^,.]*,[^,.]*")


class BadTableError(ValueError):
    """Text that is no table; `line` says where."""

    def __init__(self, line: int, message: str) -> None:
        super().__init__(message)
        self.line = line


class Row(NamedTuple):
    """A row of a table."""

    line: int
    """Of the text, its last one where a quoted field has several."""
    fields: list[str]


class CsvTable(NamedTuple):
    """A table whose rows are read one by one."""

    header: tuple[str, ...]
    """Names of the columns as they are written, without blanks around them; `()` for no text."""
    header_line: int
    separator: str
    rows: Iterator[Row]
    """Without empty rows; raises BadTableError where the text is no table. Empty fields behind the
    last column are left out."""

    def number(self, field: str) -> float:
        """Return the number in a field; raises ValueError as `number_in` does."""
        if self.separator != "," and _DECIMAL_COMMA.fullmatch(field):
            return number_in(field.replace(",", "."))
        return number_in(field)


def table_in(text: str) -> CsvTable:
    """Return the table that a text is; raises BadTableError where its header is none."""
    first = _first_line(text)
    if first is None:
        return CsvTable((), 1, ",", iter(()))
    separator = max(_SEPARATORS, key=first.count)
    rows = _rows(text, separator)
    head = next(rows)
    remark = _remark_above(text, head.line)
    if remark is not None and _all_numbers(CsvTable((), 0, separator, rows), head.fields):
        names = [field.strip() for field in remark.split(separator)]
        if len(names) == len(head.fields):
            return CsvTable(tuple(names), head.line - 1, separator, _chained(head, rows))
    header = [field.strip() for field in head.fields]
    while len(header) > 1 and not header[-1]:
        header.pop()
    return CsvTable(tuple(header), head.line, separator, _trimmed(rows, len(header)))


def _first_line(text: str) -> str | None:
    lines = io.StringIO(text, newline="")
    return next((line for line in lines if line.strip() and not _is_remark(line)), None)


def _is_remark(line: str) -> bool:
    return line.lstrip().startswith(REMARK)


def _rows(text: str, separator: str) -> Iterator[Row]:
    lines = ("\n" if _is_remark(line) else line for line in io.StringIO(text, newline=""))
    reader = csv.reader(lines, strict=True, delimiter=separator)
    try:
        for fields in reader:
            if any(field.strip() for field in fields):
                yield Row(reader.line_num, fields)
    except csv.Error as error:
        raise BadTableError(reader.line_num, f"not a CSV file: {error}") from error


def _trimmed(rows: Iterator[Row], width: int) -> Iterator[Row]:
    for row in rows:
        behind = any(field.strip() for field in row.fields[width:])
        yield row if behind else row._replace(fields=row.fields[:width])


def _chained(first: Row, rows: Iterator[Row]) -> Iterator[Row]:
    yield first
    yield from rows


def _remark_above(text: str, line: int) -> str | None:
    """The remark in the line above another, without its mark."""
    above = None
    for number, content in enumerate(io.StringIO(text, newline=""), start=1):
        if number == line - 1:
            above = content
            break
    return None if above is None or not _is_remark(above) else above.lstrip()[1:].strip()


def _all_numbers(table: CsvTable, fields: list[str]) -> bool:
    try:
        return bool([table.number(field) for field in fields])
    except ValueError:
        return False
