"""Tables as a person reads them, at any width."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from functools import partial

from rich import box
from rich.cells import cell_len
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from hmcs.shown import plain

Cell = str | Text
"""A word from anywhere, or text whose styles are the caller's."""
_ROOM_FOR_LINES = 60
"""Columns of a terminal."""
_NEVER_FOLDED, _LEAST_FOLDED, _LEAST_LAST = 24, 16, 12
"""Widths: up to which words stay in one line, and what those that go on in the next have at least,
in the last column and before it."""
_AS_LONG_AS_IT_IS = 100_000
"""Columns of what goes to a file or another program."""
_INDENT = 2


def screen() -> Console:
    """Return the console of standard output; what is printed is text without marks.

    Where that is no terminal the lines of a table are as long as they are, unless COLUMNS says how
    long.
    """
    make = partial(Console, highlight=False, markup=False, emoji=False, soft_wrap=True)
    console = make()
    if console.is_terminal or os.environ.get("COLUMNS", "").isdecimal():
        return console
    return make(width=_AS_LONG_AS_IT_IS)


def show_table(
    console: Console,
    title: str,
    columns: Sequence[str],
    rows: Sequence[Sequence[Cell]],
    numbers: Sequence[str] = (),
) -> None:
    """Print what `table_of` returns for the console."""
    shown = table_of(title, columns, rows, numbers, width=console.width, drawn=console.is_terminal)
    console.print(shown, soft_wrap=False)


def table_of(
    title: str,
    columns: Sequence[str],
    rows: Sequence[Sequence[Cell]],
    numbers: Sequence[str] = (),
    *,
    width: int,
    drawn: bool,
) -> RenderableType:
    """Return a table; the columns named in `numbers` end at their right.

    Where `width` leaves little room the words of long cells go on in the next line; where it leaves
    less, each row stands in lines of its own. Nothing is cut off. Lines between the cells are drawn
    only if `drawn`, and there is room.
    """
    shown = [[_text(cell) for cell in row] for row in rows]
    heads = [Text(column) for column in columns]
    cells = list(zip(heads, *shown, strict=True))
    folds = [_may_fold(column, column[0].plain in numbers) for column in cells[:-1]] + [True]
    widths = [_least_width(column, fold) for column, fold in zip(cells, folds, strict=True)]
    last = max(cell.cell_len for cell in cells[-1])
    drawn = drawn and width >= _ROOM_FOR_LINES
    between = 3 if drawn else 2
    room = width - (sum(widths[:-1]) + between * len(columns) + drawn)
    if room < min(last, _LEAST_LAST):
        return Group(*_blocks(title, columns, shown, width))
    table = Table(
        title=Text(plain(title)) if title else None,
        title_justify="left",
        box=box.HEAVY_HEAD if drawn else None,
        pad_edge=drawn,
        padding=(0, 1) if drawn else (0, 2, 0, 0),
    )
    for column, fold in zip(columns, folds, strict=True):
        table.add_column(
            Text(column),
            justify="right" if column in numbers else "left",
            overflow="fold",
            no_wrap=not fold,
        )
    for row in shown:
        table.add_row(*row)
    return table


def _text(cell: Cell) -> Text:
    return cell if isinstance(cell, Text) else Text(plain(cell))


def _may_fold(column: Sequence[Text], number: bool) -> bool:
    return not number and max(cell.cell_len for cell in column) > _NEVER_FOLDED


def _least_width(column: Sequence[Text], fold: bool) -> int:
    if not fold:
        return max(cell.cell_len for cell in column)
    words = (cell_len(word) for cell in column for word in cell.plain.split())
    return max([_LEAST_FOLDED, *words])


def _blocks(
    title: str, columns: Sequence[str], rows: Iterable[Sequence[Text]], width: int
) -> Iterator[Text]:
    """Yield lines: of each row the first cell, then the others by their columns' names."""
    if title:
        yield Text(plain(title))
    for first, *others in rows:
        yield first
        line = Text()
        for column, cell in zip(columns[1:], others, strict=True):
            if not cell:
                continue
            named = Text.assemble(f"{column}: " if column else "", cell)
            if line and line.cell_len + named.cell_len + _INDENT > width:
                yield line
                line = Text()
            line = Text.assemble(line, " " * _INDENT, named)
        if line:
            yield line
