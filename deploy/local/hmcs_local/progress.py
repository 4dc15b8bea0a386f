"""Progress of what takes a while, on standard error and only where somebody looks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn


@contextmanager
def fits_shown(wanted: bool) -> Iterator[Callable[[int, int], None]]:
    """Yield the callback that takes how many of all fits are done."""
    console = Console(stderr=True)
    with Progress(
        "choosing settings",
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not (wanted and console.is_terminal),
    ) as progress:
        bar = progress.add_task("choosing settings", total=None)
        yield lambda done, total: progress.update(bar, completed=done, total=total)
