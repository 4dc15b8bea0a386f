"""The pictures of the report. One color a state, the same in all of them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hmcs.fixtures.compliance.factor import FREE_FACTOR
from hmcs.palette import FAINT, GRID_COLOR, INK, STATE_COLORS, UNKNOWN_COLOR, state_color
from hmcs.recognition.scoring import NONE
from hmcs_demo.measure import Measured
from hmcs_demo.summary import Summary
from hmcs_demo.tracks import Track, recognized

SWAP_COLOR = "#000000"
HOP_COLORS = (STATE_COLORS[0], STATE_COLORS[2], STATE_COLORS[3])
SHOWN_AROUND_SWAP_S = 8.0

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "axes.titlesize": 11.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelcolor": INK,
    "axes.edgecolor": FAINT,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": INK,
    "ytick.color": INK,
    "legend.frameon": False,
    "savefig.dpi": 160,
    "savefig.facecolor": "white",
}


def draw_paths(measured: Measured, path: Path) -> None:
    """Draw where hand and robot went, colored by what was recognized."""
    gone = np.concatenate([measured.hand.position, measured.tool.position])
    _, width_m, height_m = np.ptp(gone, axis=0)
    with _figure(path, 11.0, float(np.clip(5.0 * height_m / width_m, 3.0, 8.0)) + 1.2) as figure:
        axes = figure.subplots(1, 2, sharex=True, sharey=True)
        for ax, track, title in (
            (axes[0], measured.hand, "The operator's hand"),
            (axes[1], measured.tool, "The robot's tool"),
        ):
            _path(ax, measured, track)
            ax.set_title(title)
            ax.set_xlabel("y, m (positive to the robot's left)")
        axes[0].invert_xaxis()
        axes[0].set_ylabel("z, m")
        if measured.stops:
            axes[1].text(
                *(0.02, 0.02),
                "It stopped by itself, and was re-engaged.",
                transform=axes[1].transAxes,
                fontweight="bold",
            )
        figure.legend(handles=_path_legend(measured), loc="outside lower center", ncols=8)


def _path(ax: Axes, measured: Measured, track: Track) -> None:
    points = track.position[:, 1:]
    states = recognized(track.sample, measured.step_end, measured.believed_states)
    # The first time each letter is written is drawn over the later ones.
    later = track.sample[1:] >= _first_pass_end(measured)
    lines = np.stack([points[:-1], points[1:]], axis=1)
    for shown, width, shade in ((later, 1.3, 0.75), (~later, 3.0, 1.0)):
        colors = [_tinted(_color(state), shade) for state in states[1:][shown]]
        ax.add_collection(
            LineCollection(list(lines[shown]), colors=colors, linewidths=width, capstyle="round")
        )
    for segment in measured.segments:
        start = int(np.searchsorted(track.sample, segment.begin))
        if start == len(track.sample):
            continue
        first = segment.begin < _first_pass_end(measured)
        ax.plot(
            *points[start], "o", ms=7 if first else 4.5, mfc="white", mec=INK, mew=1.4, zorder=3
        )
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.margins(0.05)
    ax.grid(color=GRID_COLOR, linewidth=0.6)
    ax.set_axisbelow(True)


def _first_pass_end(measured: Measured) -> int:
    """Number of the sample at which a state comes for the second time."""
    seen: set[int] = set()
    for segment in measured.segments:
        if segment.state in seen:
            return segment.begin
        seen.add(segment.state)
    return measured.segments[-1].end


def _path_legend(measured: Measured) -> list[Line2D]:
    handles = [
        Line2D([], [], color=_color(index), linewidth=3, label=name)
        for index, name in enumerate(measured.states)
    ]
    switch = Line2D(
        *([], []),
        marker="o",
        linestyle="",
        ms=7,
        mfc="white",
        mec=INK,
        mew=1.4,
        label="true switch",
    )
    again = Line2D([], [], color="#777777", linewidth=1.3, label="written again")
    return [*handles, switch, again]


def draw_belief(measured: Measured, summary: Summary, path: Path) -> None:
    """Draw what was believed beside what was true, and how stiff that made the fixture."""
    with _figure(path, 11.0, 5.4) as figure:
        truth, belief, fixture = figure.subplots(
            3, 1, sharex=True, height_ratios=[0.16, 1.0, 0.55], gridspec_kw={"hspace": 0.06}
        )
        _bands(truth, measured)
        truth.set_title("What the hand truly writes, what is believed, and the fixture it earns")
        shown = np.isfinite(measured.unknown)
        belief.stackplot(
            measured.step_time_s[shown],
            measured.probabilities[shown].T,
            measured.unknown[shown],
            colors=[*(_color(k) for k in range(len(measured.states))), UNKNOWN_COLOR],
            linewidth=0,
            step="post",
        )
        belief.set_ylim(0, 1)
        belief.set_ylabel("probability")
        fixture.plot(measured.factor_time_s, measured.factor, color=INK, linewidth=1.2)
        fixture.axhline(FREE_FACTOR, color=FAINT, linewidth=0.8, linestyle=(0, (4, 3)))
        fixture.text(
            1.005, FREE_FACTOR, "free\nmotion", transform=fixture.get_yaxis_transform(), va="center"
        )
        fixture.set_ylim(0.4, 1.0)
        fixture.set_ylabel("fixturing factor k")
        fixture.set_xlabel("time since the hand began to move, s")
        fixture.set_xlim(0, measured.motion_s)
        for ax in (belief, fixture):
            ax.axvline(summary.swap.at_s, color=SWAP_COLOR, linewidth=1.4)
        fixture.annotate(
            f"{summary.swap.killed} is killed",
            (summary.swap.at_s, 0.95),
            xytext=(6, 0),
            textcoords="offset points",
            va="center",
            fontsize=9.5,
        )
        legend = [*_state_patches(measured), Patch(color=UNKNOWN_COLOR, label="unknown")]
        figure.legend(handles=legend, loc="outside lower center", ncols=8)


def _bands(ax: Axes, measured: Measured) -> None:
    for segment in measured.segments:
        begin_s, end_s = measured.clock.when(segment.begin), measured.clock.when(segment.end)
        ax.axvspan(begin_s, end_s, color=_color(segment.state), linewidth=0)
        ax.text(
            (begin_s + end_s) / 2,
            0.5,
            measured.states[segment.state] if segment.state != NONE else "",
            ha="center",
            va="center",
            color="white",
            fontweight="bold",
            fontsize=9.0,
        )
    ax.set_ylim(0, 1)
    ax.set_yticks([])
    ax.tick_params(axis="x", length=0)
    for spine in ax.spines.values():
        spine.set_visible(False)


def draw_latency(measured: Measured, summary: Summary, path: Path) -> None:
    """Draw how long each hop took, and what the swap did to the slow loop."""
    with _figure(path, 11.0, 4.4) as figure:
        spread, swap = figure.subplots(1, 2)
        _distributions(spread, measured, summary)
        _around_swap(swap, measured, summary)
        figure.legend(handles=spread.get_lines()[::2], loc="outside lower center", ncols=3)


def _distributions(ax: Axes, measured: Measured, summary: Summary) -> None:
    latency = summary.latency_ms
    for values, figures, name, color in (
        (measured.hops.step_to_belief, latency.step_to_belief, "step → belief", HOP_COLORS[0]),
        (measured.hops.input_to_command, latency.input_to_command, "hand → command", HOP_COLORS[1]),
        (measured.hops.input_to_robot, latency.input_to_robot, "hand → robot state", HOP_COLORS[2]),
    ):
        ordered = np.sort(values)
        share = np.arange(1, len(ordered) + 1) / len(ordered)
        ax.step(
            ordered,
            share,
            where="post",
            color=color,
            linewidth=1.8,
            label=f"{name}: p50 {figures.p50:.1f} ms, p99 {figures.p99:.1f} ms",
        )
        ax.plot([figures.p50, figures.p99], [0.5, 0.99], "o", ms=5, mfc="white", mec=color, mew=1.6)
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter("{x:g}")
    ax.set_ylim(0, 1.02)
    ax.grid(color=GRID_COLOR, linewidth=0.6, which="both")
    ax.set_title("How long each hop took")
    ax.set_xlabel("latency, ms (logarithmic)")
    ax.set_ylabel("share of messages that took at most so long")
    ax.set_xlim(left=0.1)


def _around_swap(ax: Axes, measured: Measured, summary: Summary) -> None:
    swap = summary.swap
    since_s = measured.step_time_s - swap.at_s
    near = np.abs(since_s) <= SHOWN_AROUND_SWAP_S
    answered = near & (measured.believed_states != NONE)
    ax.plot(since_s[answered], measured.belief_delay_ms[answered], "o", ms=3.5, color=HOP_COLORS[0])
    missing = near & ~answered
    if missing.any():
        ax.plot(
            since_s[missing],
            measured.belief_delay_ms[missing],
            "x",
            ms=7,
            mew=2,
            color=STATE_COLORS[3],
        )
    ax.axvline(0, color=SWAP_COLOR, linewidth=1.4)
    ax.axvline(swap.ready_after_s, color=SWAP_COLOR, linewidth=1.4, linestyle=(0, (4, 3)))
    top_ms = max(1.25 * float(measured.belief_delay_ms[near].max(initial=0.0)), 5.0)
    ax.set_ylim(0, top_ms)
    for at_s, text, side in ((0.0, "killed", -1), (swap.ready_after_s, "newcomer ready", 1)):
        ax.annotate(
            text,
            (at_s, 0.98 * top_ms),
            xytext=(5 * side, 0),
            textcoords="offset points",
            ha="left" if side > 0 else "right",
            va="top",
        )
    ax.set_xlim(-SHOWN_AROUND_SWAP_S, SHOWN_AROUND_SWAP_S)
    ax.grid(color=GRID_COLOR, linewidth=0.6)
    ax.set_title("From each step to its belief, around the swap")
    ax.set_xlabel(f"time since {swap.killed} was killed, s")
    ax.set_ylabel("step → belief, ms")


def draw_path_error(measured: Measured, path: Path) -> None:
    """Draw how far hand and robot were from the mean demonstration, segment by segment."""
    with _figure(path, 11.0, 3.6) as figure:
        ax = figure.subplots()
        for offset, track, shade in ((-0.19, measured.hand, 0.35), (0.19, measured.tool, 1.0)):
            for number, segment in enumerate(measured.segments):
                within = (track.sample >= segment.begin) & (track.sample < segment.end)
                error_mm = 1e3 * track.error_m[within & np.isfinite(track.error_m)]
                if len(error_mm):
                    rms_mm = float(np.sqrt(np.mean(error_mm**2)))
                    color = _tinted(_color(segment.state), shade)
                    ax.bar(number + offset, rms_mm, width=0.36, color=color)
        ax.set_xticks(
            range(len(measured.segments)), [measured.states[s.state] for s in measured.segments]
        )
        ax.tick_params(axis="x", length=0)
        ax.grid(color=GRID_COLOR, linewidth=0.6, axis="y")
        ax.set_axisbelow(True)
        ax.set_title("Distance to the mean demonstration, segment by segment")
        ax.set_ylabel("root mean square, mm")
        ax.legend(
            handles=[
                Patch(color=_tinted(INK, 0.35), label="hand"),
                Patch(color=INK, label="robot's tool"),
            ],
            loc="upper right",
            ncols=2,
        )


def _state_patches(measured: Measured) -> list[Patch]:
    return [Patch(color=_color(k), label=name) for k, name in enumerate(measured.states)]


def _color(state: int) -> str:
    return UNKNOWN_COLOR if state == NONE else state_color(state)


def _tinted(color: str, share: float) -> tuple[float, float, float]:
    """A color mixed with white."""
    red, green, blue = (1 - share * (1 - part) for part in to_rgb(color))
    return red, green, blue


@contextmanager
def _figure(path: Path, width_in: float, height_in: float) -> Iterator[Figure]:
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(width_in, height_in), layout="constrained")
        yield figure
        figure.savefig(path)
