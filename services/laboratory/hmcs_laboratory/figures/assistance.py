"""Figure B.3: what each fixture law is worth, error against time, one point a law."""

from __future__ import annotations

import numpy as np

from hmcs_laboratory.assistance.laws import DEFAULT_LAW, LAWS
from hmcs_laboratory.assistance.scenarios import TASKS
from hmcs_laboratory.data.hands import Count
from hmcs_laboratory.figures.drawing import FAINT, Drawn, Number, color_of, mark_of, new_picture
from hmcs_laboratory.studies.assistance import AssistanceSettings, assistance_trial
from hmcs_laboratory.summary import CI95, rows_of

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
    laws = [law.name for law in LAWS if law.name in {row["law"] for row in rows}]
    tasks = [task for task in TASKS if task in {row["task"] for row in rows}]
    picture = new_picture(6.6)
    axes = picture.subplots(2, 3, squeeze=False).ravel()
    numbers: dict[str, Number] = {"laws": laws}
    for ax, task in zip(axes, tasks, strict=False):
        ax.axhline(1.0, color=FAINT, linewidth=0.8)
        ax.axvline(1.0, color=FAINT, linewidth=0.8)
        for row in rows:
            if row["task"] != task or row.get("error_ratio") is None:
                continue
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
                label=row["law"],
            )
            numbers[f"{task}_{row['law']}"] = [
                _number(row["error_ratio"]),
                _number(row["time_ratio"]),
            ]
        ax.set_title(_TITLES[task])
        ax.set_xlabel("time / unaided")
        ax.set_ylabel("RMS path error / unaided")
        shown = [row for row in rows if row["task"] == task and row.get("error_ratio") is not None]
        # Intervals of few trials may reach far beyond the picture.
        ax.set_ylim(0.0, 1.25 * max(_number(row["error_ratio"]) for row in shown))
        ax.set_xlim(0.9, 1.1 * max(_number(row["time_ratio"]) for row in shown))
    for ax in axes[len(tasks) :]:
        ax.set_axis_off()
    handles, labels = axes[0].get_legend_handles_labels()
    picture.legend(handles, labels, loc="outside lower center", ncols=len(handles))
    best = [
        min(
            (row for row in rows if row["task"] == task and row.get("error_ratio") is not None),
            key=lambda row: _number(row["error_ratio"]),
        )
        for task in tasks
    ]
    told = ", ".join(
        f"{_TITLES[task]}: {row['law']} ({_number(row['error_ratio']):.2f})"
        for task, row in zip(tasks, best, strict=True)
    )
    return Drawn(
        picture,
        numbers,
        f"Down and to the left is better. The least error: {told}.",
        "The thesis has no such comparison.",
    )


def _number(value: str | int | float | None) -> float:
    return float(value) if isinstance(value, (int, float)) else 0.0
