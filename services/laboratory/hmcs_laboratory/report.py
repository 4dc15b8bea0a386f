"""How a study is reported: a table, one JSON object, and progress while it runs."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from hmcs_laboratory.running import Progress as Told
from hmcs_laboratory.running import StudyResult
from hmcs_laboratory.study import Study, StudySettings
from hmcs_laboratory.summary import CI95, Row


def as_json(result: StudyResult) -> str:
    """Return the result as one line of JSON."""
    return json.dumps(result._asdict(), allow_nan=False)


def as_table(result: StudyResult, shown: Sequence[str] = ()) -> Table:
    """Return the result as a table: mean ± half width of the 95 % interval.

    `shown` are the columns to show; all where there are none.
    """
    # Folded rather than cut short where the screen is too narrow.
    table = Table(title=f"{result.study}: {result.trials} trials, seed {result.seed}")
    columns = list(dict.fromkeys(name for row in result.rows for name in row))
    columns = [name for name in shown if name in columns] or columns
    for column in columns:
        if not column.endswith(CI95):
            table.add_column(
                column, justify="left" if column == columns[0] else "right", overflow="fold"
            )
    for row in result.rows:
        table.add_row(*(_cell(row, name) for name in columns if not name.endswith(CI95)))
    return table


def studies_table(studies: Sequence[Study[StudySettings]]) -> Table:
    """Return a table of all studies, a line each."""
    table = Table(title="studies")
    for column in ("study", "asks", "after"):
        table.add_column(column, overflow="fold")
    for study in studies:
        table.add_row(study.name, study.line, study.source)
    return table


@contextmanager
def progress_shown(console: Console, name: str, trials: int) -> Iterator[Told]:
    """Yield what is to be called with the number of trials done.

    Draws a bar on a terminal, and prints a line a trial elsewhere.
    """
    if not console.is_terminal:
        began_s = time.monotonic()
        yield lambda done: console.print(
            f"{name}: trial {done} of {trials} after {time.monotonic() - began_s:.0f} s",
            highlight=False,
        )
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(name, total=trials)
        yield lambda done: bar.update(task, completed=done)


def _cell(row: Row, name: str) -> str:
    if name not in row:
        return ""
    value, half = row[name], row.get(name + CI95)
    if value is None:
        return "–"
    if not isinstance(value, float):
        return str(value)
    return f"{value:.4g}" + (f" ± {half:.2g}" if isinstance(half, float) else "")
