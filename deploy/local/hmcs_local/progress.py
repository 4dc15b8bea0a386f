"""Progress of what takes a while, on standard error and only where somebody looks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn


@contextmanager
def fits_shown(wanted: bool) -> Iterator[Callable[[int, int], None]]:
    """Yield the callback that takes how many of all fits are done."""
    with progress_shown("choosing settings", wanted) as update:
        yield update


@contextmanager
def progress_shown(what: str, wanted: bool = True) -> Iterator[Callable[[int, int], None]]:
    """Yield the callback that takes how much of all is done of `what`."""
    console = Console(stderr=True)
    with Progress(
        what,
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not (wanted and console.is_terminal),
    ) as progress:
        bar = progress.add_task(what, total=None)
        yield lambda done, total: progress.update(bar, completed=done, total=total)
