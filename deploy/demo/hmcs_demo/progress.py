"""The live progress line: redrawn on a terminal, one plain line now and then elsewhere."""

from __future__ import annotations

import time
from types import TracebackType
from typing import NamedTuple, Self

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

PROGRESS = "progress"
"""The event that says how far the run is; its facts are those of `Progress`."""
_PLAIN_EVERY_S = 5.0
_BAR_WIDTH = 10


class Progress(NamedTuple):
    """How far a run is, as the observer logs it."""

    phase: str
    """`waiting`, `moving` or `finished`."""
    moving_s: float
    state: str
    """The most probable one."""
    confidence: float
    factor: float
    """k of the fixture."""
    steps: int
    missing_steps: int
    """Steps without a belief, the newest one left out."""
    lost: int


class ProgressLine:
    """Shows how far a run is. `say` prints an event for good, `show` how things stand now."""

    def __init__(self, console: Console, motion_s: float) -> None:
        self._console = console
        self._motion_s = motion_s
        self._live = Live(console=console, auto_refresh=False, transient=True)
        self._shown_s = -_PLAIN_EVERY_S

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._console.is_terminal:
            self._live.stop()

    def say(self, text: str) -> None:
        """Tell an event, above the line."""
        self._console.print(text)

    def show(self, progress: Progress) -> None:
        """Show how far the hand is and what is recognized."""
        if self._console.is_terminal:
            row = Table.grid(padding=(0, 1))
            row.add_row(
                ProgressBar(self._motion_s, progress.moving_s, width=_BAR_WIDTH),
                _standing(progress, self._motion_s),
            )
            self._live.update(row, refresh=True)
        elif progress.state and time.monotonic() - self._shown_s >= _PLAIN_EVERY_S:
            self._shown_s = time.monotonic()
            self._console.print(_standing(progress, self._motion_s))


def _standing(progress: Progress, motion_s: float) -> Text:
    return Text.assemble(
        f"{progress.moving_s:3.0f}/{motion_s:.0f} s  ",
        (f"{progress.state or '-':<12}", "bold"),
        f"p {progress.confidence:.2f}  k {progress.factor:.2f}  steps {progress.steps}  ",
        (f"missing {progress.missing_steps}  lost {progress.lost}", _alarm(progress)),
        no_wrap=True,
    )


def _alarm(progress: Progress) -> str:
    return "red" if progress.missing_steps or progress.lost else "dim"
