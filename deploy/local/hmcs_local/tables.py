"""Tables as a person reads them, at any width."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from hmcs.shown import plain

_ROOM_FOR_LINES = 60
"""Columns of a terminal."""
_LEAST_LAST = 12
"""Columns that the last column has at least where its words go on in the next line."""


def show_table(
    console: Console,
    title: str,
    columns: Sequence[str],
    rows: Sequence[Sequence[str]],
    numbers: Sequence[str] = (),
) -> None:
    """Print a table of words from anywhere; the columns named in `numbers` end at their right.

    Where there is little room the words of the last column go on in the next line; where there is
    less, each row stands in lines of its own. Nothing is cut off. No lines are drawn there, and
    where nobody looks.
    """
    shown = [[plain(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(columns, *shown, strict=True)]
    drawn = console.is_terminal and console.width >= _ROOM_FOR_LINES
    between = 3 if drawn else 2
    room = console.width - (sum(widths[:-1]) + between * len(columns) + drawn)
    if room < min(widths[-1], _LEAST_LAST):
        _show_blocks(console, title, columns, shown)
        return
    table = Table(
        title=Text(plain(title)),
        title_justify="left",
        box=box.HEAVY_HEAD if drawn else None,
        pad_edge=drawn,
        padding=(0, 1) if drawn else (0, 2, 0, 0),
    )
    for column in columns:
        table.add_column(
            column,
            justify="right" if column in numbers else "left",
            overflow="fold",
            no_wrap=column != columns[-1],
        )
    for row in shown:
        table.add_row(*map(Text, row))
    console.print(table)


def _show_blocks(
    console: Console, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]
) -> None:
    console.print(Text(plain(title)))
    for first, *others in rows:
        console.print(Text(first))
        for column, cell in zip(columns[1:], others, strict=True):
            console.print(Text(f"  {column}: {cell}"))
