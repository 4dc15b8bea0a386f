"""A replay beside its recording over time: what was believed, how stiff, how fast."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from numpy.typing import NDArray

from hmcs.fixtures.compliance.factor import FREE_FACTOR
from hmcs.recordings.fixture_replay import FixtureReplay
from hmcs.recordings.replaying import Replay
from hmcs.recordings.stretches import Stretch
from hmcs_laboratory.figures.drawing import (
    FAINT,
    INK,
    color_of,
    house_style,
    new_picture,
)

NOW_COLOR = "#CC3311"
"""Of what is replayed, over what was recorded."""
GAP_S = 0.5
"""A line is broken where nothing was recorded for so long."""

Floats = NDArray[np.float64]
Band = tuple[float, float, str]
"""Beginning and end, s, and the state."""


def draw_replay(
    path: Path,
    form: str,
    replay: Replay,
    fixture_replay: FixtureReplay,
    labels: Sequence[Stretch],
    begun_ns: int,
) -> None:
    """Draw states, factor and commanded speed over the time since `begun_ns`.

    `form` is png or svg. Raises OSError as writing does.
    """

    def seconds(log_ns: Iterable[int]) -> Floats:
        return np.array([(at - begun_ns) / 1e9 for at in log_ns])

    with house_style():
        picture = new_picture(7.5)
        states, factor, speed = picture.subplots(3, 1, sharex=True, height_ratios=[1.1, 1.0, 1.0])
        _draw_states(states, replay, labels, seconds)
        _draw_factor(factor, fixture_replay, seconds(tick.log_ns for tick in fixture_replay.ticks))
        _draw_speed(speed, fixture_replay, seconds(tick.log_ns for tick in fixture_replay.ticks))
        speed.set_xlabel("time since the recording began, s")
        picture.savefig(path, format=form)


def _draw_states(ax: Axes, replay: Replay, labels: Sequence[Stretch], seconds: Any) -> None:
    at_s = seconds(each.log_ns for each in replay.beliefs)
    known = [(k, each.recorded) for k, each in enumerate(replay.beliefs) if each.recorded]
    rows: list[tuple[str, list[Band]]] = [
        ("replayed", _bands(at_s, [each.replayed.likely_state for each in replay.beliefs])),
        ("recorded", _bands(at_s[[k for k, _ in known]], [then.likely_state for _, then in known])),
        (
            "truth, by labels",
            [
                (*seconds((label.begin_ns, label.end_ns)), label.state.partition("/")[0])
                for label in labels
            ],
        ),
    ]
    rows = [(name, bands) for name, bands in rows if bands]
    drawn = {state: None for _, bands in rows for _, _, state in bands}
    of_task = [state for each in replay.beliefs[:1] for state in each.replayed.states]
    names = list(dict.fromkeys([*of_task, *drawn]))
    for row, (_, bands) in enumerate(rows):
        for begin_s, end_s, state in bands:
            color = color_of(names.index(state))
            ax.barh(row, end_s - begin_s, left=begin_s, height=0.75, color=color, linewidth=0)
    ax.set_yticks(range(len(rows)), [name for name, _ in rows])
    ax.grid(visible=False, axis="y")
    ax.set_title("Which state of the task it was taken for")
    ax.legend(
        handles=[
            Patch(color=color_of(k), label=name) for k, name in enumerate(names) if name in drawn
        ],
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
    )


def _draw_factor(ax: Axes, fixture_replay: FixtureReplay, at_s: Floats) -> None:
    recorded = [np.nan if tick.then is None else tick.then.factor for tick in fixture_replay.ticks]
    _draw_both(ax, at_s, recorded, [tick.now.factor for tick in fixture_replay.ticks])
    ax.axhline(FREE_FACTOR, color=FAINT, linewidth=0.9, linestyle=(0, (4, 3)))
    ax.text(1.005, FREE_FACTOR, "free", transform=ax.get_yaxis_transform(), va="center")
    ax.set_ylabel("factor k, 0.5 to 1")
    ax.set_title("How stiff the fixture is")


def _draw_speed(ax: Axes, fixture_replay: FixtureReplay, at_s: Floats) -> None:
    def mm_s(velocity: Floats) -> float:
        return 1e3 * float(np.linalg.norm(velocity))

    recorded = [
        np.nan if tick.then is None else mm_s(tick.then.velocity) for tick in fixture_replay.ticks
    ]
    _draw_both(ax, at_s, recorded, [mm_s(tick.now.velocity) for tick in fixture_replay.ticks])
    ax.set_ylabel("speed, mm/s")
    ax.set_title("Commanded speed of the robot")


def _draw_both(ax: Axes, at_s: Floats, recorded: list[float], replayed: list[float]) -> None:
    """The recorded line wide and dark, the replayed one narrow over it: where they agree both show.

    Either is broken where samples stayed out.
    """
    broken = np.flatnonzero(np.diff(at_s) > GAP_S) + 1
    times = np.insert(at_s, broken, np.nan)
    for values, name, color, width in (
        (recorded, "recorded", INK, 2.6),
        (replayed, "replayed", NOW_COLOR, 1.1),
    ):
        line = np.insert(np.array(values, dtype=float), broken, np.nan)
        if np.isfinite(line).any():
            ax.plot(times, line, color=color, linewidth=width, label=name)
    if ax.lines:
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _bands(at_s: Floats, states: Sequence[str]) -> list[Band]:
    """Runs of one state, each up to where the next begins: a hand at rest makes no steps."""
    if not len(at_s):
        return []
    begins = [0, *(k for k, (one, other) in enumerate(pairwise(states), 1) if one != other)]
    ends = [*begins[1:], len(states) - 1]
    return [
        (float(at_s[begin]), float(at_s[end]), states[begin])
        for begin, end in zip(begins, ends, strict=True)
    ]
