"""`hmcs check`: what demonstrations are like, in a table, and what to do about them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from rich.console import Console

from hmcs.arrays import Array
from hmcs.recordings.foreign.choices import AS_IT_IS, Choices
from hmcs.shown import plain
from hmcs.task import load_task
from hmcs_local.tables import show_table
from hmcs_trainer.checking import Judged, check_files

_COLUMNS = ("file", "trains", "units", "Hz", "lasts, s", "way, m", "extent, m")
_NUMBERS = ("Hz", "lasts, s", "way, m")
_LONGEST = 4000


def show_check(
    references: Iterable[str], task: str, console: Console, choices: Choices = AS_IT_IS
) -> bool:
    """Show what is known of each demonstration; return whether none would be refused."""
    loaded = load_task(task) if task else None
    check = check_files(references, loaded, choices)
    if check.judged:
        columns = (*_COLUMNS, *(() if loaded is None else ("workspace",)), "states")
        title = "demonstrations" if loaded is None else f"demonstrations of {loaded.name}"
        show_table(console, title, columns, [_row(each) for each in check.judged], _NUMBERS)
        if loaded is None:
            lower = np.min([each.lower_m for each in check.judged], axis=0)
            upper = np.max([each.upper_m for each in check.judged], axis=0)
            _say(console, f"they lie between {_numbers(lower)} and {_numbers(upper)} m (x y z)")
    for finding in check.findings:
        word = "refused" if finding.serious else "mind"
        _say(console, f"{word}: {plain(finding.text, _LONGEST)}")
    return not any(finding.serious for finding in check.findings)


def _say(console: Console, line: str) -> None:
    console.print(line, markup=False, highlight=False, soft_wrap=True)


def _row(each: Judged) -> tuple[str, ...]:
    sides = np.subtract(each.upper_m, each.lower_m)
    workspace = () if each.fits is None else ("fits" if each.fits else "leaves it",)
    return (
        each.name,
        each.verdict,
        each.units,
        f"{each.rate_hz:.4g}",
        f"{each.lasts_s:.2f}",
        f"{each.way_m:.2f}",
        _numbers(sides, " × "),
        *workspace,
        ", ".join(each.states) or "none",
    )


def _numbers(values: Sequence[float] | Array, between: str = " ") -> str:
    # A zero has no sign.
    return between.join(f"{round(float(value), 2) + 0.0:.2f}" for value in values)
