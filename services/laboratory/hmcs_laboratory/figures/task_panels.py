"""The panels of a task that is followed: likelihoods, probabilities, gestemes, changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from hmcs.recognition.scoring import Scores
from hmcs_laboratory.figures.drawing import (
    INK,
    UNKNOWN_COLOR,
    change_handle,
    color_of,
    draw_changes,
    mark_of,
    new_picture,
)
from hmcs_laboratory.figures.task_following import Believed, Followed, Integers, Names

_LOWEST_NATS = -60.0
"""State likelihoods so far below the best are not drawn: they would hide the others."""


def draw_panels(
    names: Names,
    followed: Followed,
    believed: Believed,
    truth: Integers,
    changes: NDArray[np.intp],
    scores: Mapping[str, Scores],
) -> Picture:
    """Draw likelihood, probability and gesteme of each step, and the segment filter below."""
    picture = new_picture(10.4)
    axes = picture.subplots(4, 1, sharex=True, height_ratios=[1.0, 1.0, 0.75, 1.0], squeeze=True)
    raw, normalized, gestemes, ours = axes
    at = np.arange(len(truth))
    for state in range(len(names.states)):
        style = _style(state)
        raw.plot(at, followed.log_alpha[:, state], **style)
        normalized.plot(at, followed.states[:, state], **style)
        ours.plot(at, believed.states[:, state], **style)
    ours.fill_between(at, believed.unknown, step="mid", color=UNKNOWN_COLOR, alpha=0.5, linewidth=0)
    lowest = followed.log_alpha.max(axis=1).min() + _LOWEST_NATS
    raw.set_ylim(max(float(followed.log_alpha.min()), float(lowest)) - 3.0, 3.0)
    raw.set_title("Layered HMM, restart given: likelihood of each state")
    raw.set_ylabel("log likelihood, nats")
    normalized.set_title("The same, normalized")
    for gesteme in range(len(names.gestemes)):
        own = at[truth == gesteme]
        left, right = own - 0.5, own + 0.5
        gestemes.hlines(np.full(len(own), gesteme), left, right, color="#bbbbbb", linewidth=9)
    gestemes.plot(at, followed.winners, color=INK, linestyle="", marker="o", ms=4)
    gestemes.set_yticks(range(len(names.gestemes)), names.gestemes)
    gestemes.set_ylim(-0.6, len(names.gestemes) - 0.4)
    gestemes.set_title("Winning gesteme HMM (dots) and true gesteme (gray): input of the task HMM")
    gestemes.set_ylabel("gesteme")
    ours.set_title("Segment filter, no marks given: probability of each state")
    ours.set_xlabel("step")
    for ax, scored in ((normalized, scores["lhmm"]), (ours, scores["segment_filter"])):
        ax.set_ylim(-0.03, 1.22)
        ax.set_yticks([0.0, 0.5, 1.0])
        ax.set_ylabel("probability")
        _mark_delays(ax, changes, scored.switch_delays)
    for ax in axes:
        draw_changes(ax, changes.tolist())
        ax.set_xlim(-0.5, len(at) - 0.5)
    picture.legend(
        handles=_legend(names),
        loc="outside lower center",
        ncols=len(names.states) + 2,
        columnspacing=1.2,
        handlelength=1.6,
    )
    return picture


def _style(state: int) -> dict[str, Any]:
    return {
        "color": color_of(state),
        "linewidth": 1.5,
        "marker": mark_of(state),
        "ms": 3.6,
        "markevery": (state, 6),
    }


def _mark_delays(ax: Axes, changes: NDArray[np.intp], delays: NDArray[np.int64]) -> None:
    for change, delay in zip(changes, delays, strict=True):
        ax.annotate(
            f"{delay:+d}".replace("-", "−") if delay else "0",
            (change - 0.5, 1.2),
            xytext=(3, 0),
            textcoords="offset points",
            va="top",
            fontsize=9.0,
        )


def _legend(names: Names) -> Sequence[Line2D | Patch]:
    states = [
        Line2D([], [], **{**_style(s), "markevery": None}, label=f"{name} ({gesteme})")
        for s, (name, gesteme) in enumerate(
            (name, names.gestemes[names.of_state[s]]) for s, name in enumerate(names.states)
        )
    ]
    return [
        *states,
        Patch(color=UNKNOWN_COLOR, alpha=0.5, label="unknown"),
        change_handle("true change; above, its delay in steps"),
    ]
