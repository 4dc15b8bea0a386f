"""Progress of figures: a bar on a terminal, nothing elsewhere."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from hmcs_laboratory.figures.run import Progress as Told


@contextmanager
def figures_shown(console: Console) -> Iterator[Told]:
    """Yield what is to be called whenever a figure is made."""
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    ) as bar:
        task = bar.add_task("figures", total=None)

        def report(number: str, done: int, total: int) -> None:
            bar.update(task, completed=done, total=total, description=f"figure {number} made")

        yield report
