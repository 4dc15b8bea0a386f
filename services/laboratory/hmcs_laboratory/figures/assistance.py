"""Figure B.3: what each fixture law is worth, error against time, one point a law."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture
from matplotlib.lines import Line2D

from hmcs_laboratory.assistance.laws import DEFAULT_LAW, LAWS
from hmcs_laboratory.assistance.scenarios import TASKS
from hmcs_laboratory.data.hands import Count
from hmcs_laboratory.figures.drawing import FAINT, Drawn, Number, color_of, mark_of, new_picture
from hmcs_laboratory.studies.assistance import AssistanceSettings, assistance_trial
from hmcs_laboratory.summary import CI95, Row, rows_of

_TITLES = {
    "lines": "lines, as taught",
    "changed-workspace": "lines of other lengths",
    "unexpected-obstacle": "an unexpected obstacle",
    "human-curves": "human curves, as taught",
    "wrong-model": "curves beside the model",
}


class AssistanceFigureSettings(AssistanceSettings):
    """Of figure B.3."""

    trials: Count = 20
    """Of each law in each task."""


def worth_of_assistance(settings: AssistanceFigureSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure B.3: path error and time of every law, as ratios to the operator alone."""
    rows = rows_of([assistance_trial(settings, stream) for stream in rng.spawn(settings.trials)])
    numbers: dict[str, Number] = {
        f"{row['operator']}_{row['task']}_{row['law']}": [
            _number(row["error_ratio"]),
            _number(row["time_ratio"]),
        ]
        for row in rows
        if row.get("error_ratio") is not None
    }
    best = [
        min(_measured(rows, task), key=lambda row: _number(row["error_ratio"]))
        for task in _tasks(rows)
    ]
    worth = ", ".join(
        f"{_TITLES[str(row['task'])]}: {row['law']} ({_number(row['error_ratio']):.2f})"
        for row in best
    )
    return Drawn(
        picture_of(rows),
        numbers,
        f"Down and to the left is better. The least error: {worth}.",
        "The thesis has no such comparison.",
    )


def picture_of(rows: Sequence[Row]) -> Picture:
    """Return the picture of the rows of the study `assistance`: a panel a task, a point a law.

    With several operators each has a row of panels.
    """
    laws = [law.name for law in LAWS if law.name in {row["law"] for row in rows}]
    tasks, operators = _tasks(rows), list(dict.fromkeys(str(row["operator"]) for row in rows))
    panels = [(operator, task) for operator in operators for task in tasks]
    columns = min(3, len(tasks))
    lines = len(operators) * -(-len(tasks) // columns)
    picture = new_picture(0.8 + 2.9 * lines)
    axes = picture.subplots(lines, columns, squeeze=False).reshape(len(operators), -1)
    for ax in axes.ravel():
        ax.set_axis_off()
    for operator, task in panels:
        ax = axes[operators.index(operator), tasks.index(task)]
        ax.set_axis_on()
        shown = [row for row in _measured(rows, task) if row["operator"] == operator]
        _draw_panel(ax, shown, laws)
        title = _TITLES[task]
        ax.set_title(title if len(operators) == 1 else f"{operator}: {title}")
    handles = [
        Line2D([], [], color=color_of(k), marker=mark_of(k), ms=7, linestyle="", label=law)
        for k, law in enumerate(laws)
    ]
    picture.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return picture


def _draw_panel(ax: Axes, rows: Sequence[Row], laws: Sequence[str]) -> None:
    ax.axhline(1.0, color=FAINT, linewidth=0.8)
    ax.axvline(1.0, color=FAINT, linewidth=0.8)
    for row in rows:
        index = laws.index(str(row["law"]))
        ax.errorbar(
            _number(row["time_ratio"]),
            _number(row["error_ratio"]),
            xerr=_number(row.get("time_ratio" + CI95)),
            yerr=_number(row.get("error_ratio" + CI95)),
            color=color_of(index),
            marker=mark_of(index),
            ms=11 if row["law"] == DEFAULT_LAW else 7,
            linestyle="",
            elinewidth=1.0,
        )
    ax.set_xlabel("time / unaided")
    ax.set_ylabel("RMS path error / unaided")
    # Intervals of few trials may reach far beyond the picture.
    ax.set_ylim(0.0, 1.25 * max(_number(row["error_ratio"]) for row in rows))
    ax.set_xlim(0.9, 1.1 * max(_number(row["time_ratio"]) for row in rows))


def _tasks(rows: Sequence[Row]) -> list[str]:
    return [task for task in TASKS if task in {row["task"] for row in rows}]


def _measured(rows: Sequence[Row], task: str) -> list[Row]:
    return [row for row in rows if row["task"] == task and row.get("error_ratio") is not None]


def _number(value: str | int | float | None) -> float:
    return float(value) if isinstance(value, (int, float)) else 0.0
