"""Tables as a person reads them, at any width."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from hmcs.shown import plain

_ROOM_FOR_LINES = 60
"""Columns of a terminal."""


def show_table(
    console: Console,
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[str]],
    numbers: Sequence[str] = (),
) -> None:
    """Print a table of words from anywhere; the columns named in `numbers` end at their right.

    Where there is little room words go on in the next line of their cell; nothing is cut off. No
    lines are drawn there, and where nobody looks.
    """
    drawn = console.is_terminal and console.width >= _ROOM_FOR_LINES
    table = Table(
        title=Text(plain(title)),
        title_justify="left",
        box=box.HEAVY_HEAD if drawn else None,
        pad_edge=drawn,
        padding=(0, 1) if drawn else (0, 2, 0, 0),
    )
    for column in columns:
        table.add_column(column, justify="right" if column in numbers else "left", overflow="fold")
    for row in rows:
        table.add_row(*(Text(plain(cell)) for cell in row))
    console.print(table)
