"""Demonstrations that no hand made: wrong units, a tracker that jumped, samples that are missing.

Each limit is taken from the task or from what hands can do:

| limit | reason |
|---|---|
| `JUMP_STEPS` dead zones from one sample to the next | what is shorter than a step or two changes no path that is learned |
| `HARDEST_M_S2` before and after it | five times gravity; the hardest strokes of a drawing hand reach half of it |
| `FASTEST` times the robot's speed limit | a robot cannot follow what is shown ten times as fast as it moves |
| `SUDDEN` times the usual speed | where samples are too seldom to tell an acceleration |
| `FASTEST_TURN_RAD_S`, `LARGEST_TURN_RAD` from one sample to the next | a wrist turns with 20 rad/s at most, and no path of turns is seen at a third of a right angle a sample |
| `FARTHEST` times across the workspace | no mistake in showing is so large, any mistake of units is |
| `SLOWEST_S` for a step | a hand that slow stands still; times in ms or ns are a thousand or more times slower |
| `LONGEST_GAP_S`, and `GAP_PERIODS` sampling periods | devices lose some samples; in a longer gap the hand goes a way of its own |
"""  # noqa: E501  rows of a table

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import Step, steps_of
from hmcs.task import Task

JUMP_STEPS = 2.0
HARDEST_M_S2 = 50.0
FASTEST = 10.0
SUDDEN = 10.0
FASTEST_TURN_RAD_S = 40.0
LARGEST_TURN_RAD = 0.5
FARTHEST = 3.0
SLOWEST_S = 10.0
LONGEST_GAP_S = 0.5
GAP_PERIODS = 10.0
REGULAR_SHARE = 0.95
"""Samples come regularly where so many intervals are no longer than twice the usual one; a file of
corners, written by hand, has no gaps."""
_NEARLY_ALL = (1.0, 99.0)
"""Percentiles of the positions: a tracker that jumps says nothing of units."""
UNITS = {"millimeters": 1e-3, "centimeters": 1e-2, "inches": 0.0254}


class Finding(NamedTuple):
    """Something the author of the demonstrations should know."""

    serious: bool
    """Whether nothing is learned because of it."""
    text: str
    """What, where and when, and what to do."""
    may_be_accepted: bool = False
    """Whether a model can be learned nevertheless, with `--accept-implausible`."""
    unquoted: str = ""
    """The text without what a file said instead of a name of the task; empty where it is none."""


class Limits(NamedTuple):
    """What a task says of the size and speed of its motions."""

    across_m: float
    """Across the workspace."""
    dead_zone_m: float
    speed_limit_m_s: float
    """Of the robot."""
    said: str
    """Of the size, in a message."""


ANY_ARM = Limits(2.0, 0.01, 1.0, "a robot arm reaches over 2 m")
"""Where no task is known."""


def limits_of(task: Task | None) -> Limits:
    """Return the limits of a task, or those of any robot arm."""
    if task is None:
        return ANY_ARM
    box = np.array([task.workspace.lower_m, task.workspace.upper_m])
    across_m = float(np.linalg.norm(box[1] - box[0]))
    return Limits(
        across_m,
        task.dead_zone_m,
        task.robot.speed_limit_m_s,
        f"the workspace is {across_m:.2f} m across",
    )


def implausible(task: Task | None, demonstration: Demonstration) -> list[Finding]:
    """Return what no hand does: the first of each kind with its time, and how many there are.

    Without a task it is judged by what robot arms are like, and its workspace not at all.
    """
    limits = limits_of(task)
    wrong_units = list(_far(limits, demonstration))
    # Of positions in other units everything else is a consequence.
    return wrong_units or [
        *_jumps(limits, demonstration),
        *_sudden_turns(demonstration),
        *(() if task is None else _outside(task, demonstration)),
        *_wrong_times(limits, demonstration),
        *_gaps(limits, demonstration),
    ]


def likely_units(limits: Limits, shown: Demonstration) -> list[str]:
    """Return in which units positions that reach too far would fit; none where they are meters.

    None either where no unit makes them fit. A task is shown with much of its workspace, so that
    the largest unit is meant; of any robot arm nobody can tell.
    """
    extent_m = extent_of(shown)
    if extent_m <= FARTHEST * limits.across_m:
        return []
    fits = [unit for unit, size_m in UNITS.items() if extent_m * size_m <= limits.across_m]
    return fits if limits is ANY_ARM else fits[-1:]


def seems_other_times(limits: Limits, shown: Demonstration) -> bool:
    """Return whether the times are too long for the way to be seconds."""
    steps = steps_of(shown.positions, limits.dead_zone_m)
    return bool(steps) and float(shown.time_s[-1] - shown.time_s[0]) / len(steps) > SLOWEST_S


def extent_of(shown: Demonstration) -> float:
    """Return the diagonal of the box that nearly all of a way fits in, m, and no single jump."""
    lower, upper = np.percentile(shown.positions, _NEARLY_ALL, axis=0)
    return float(np.linalg.norm(upper - lower))


def _far(limits: Limits, shown: Demonstration) -> Iterator[Finding]:
    extent_m = extent_of(shown)
    if extent_m <= FARTHEST * limits.across_m:
        return
    units = " or ".join(likely_units(limits, shown))
    guess = f"are they in {units}? Give meters" if units else "mend them, or leave it out"
    yield Finding(
        True,
        f"{shown.name}: its positions reach over {extent_m:.4g} m, {limits.said}: {guess}",
        may_be_accepted=True,
    )


def _jumps(limits: Limits, shown: Demonstration) -> Iterator[Finding]:
    period_s, moved_m, speed_m_s = _motion(shown, _longest_periods(shown.time_s))
    length_m = length_of(steps_of(shown.positions, limits.dead_zone_m))
    usual_m_s = length_m / float(shown.time_s[-1] - shown.time_s[0])
    velocity = np.diff(shown.positions, axis=0) / period_s[:, None]
    change = np.linalg.norm(np.diff(velocity, axis=0), axis=1)
    harder = change / (0.5 * (period_s[1:] + period_s[:-1]))
    # At the ends nothing is known before, or after.
    hard = np.minimum(np.append(np.inf, harder), np.append(harder, np.inf)) > HARDEST_M_S2
    fast = FASTEST * limits.speed_limit_m_s
    sudden = (speed_m_s > fast) & (speed_m_s > SUDDEN * usual_m_s)
    far = moved_m >= JUMP_STEPS * limits.dead_zone_m
    jumps = np.flatnonzero(far & (hard | sudden) & _counts(shown))
    if len(jumps):
        k = int(jumps[0])
        yield Finding(
            True,
            f"{shown.name}: at {shown.time_s[k + 1]:.3f} s the hand jumps by {moved_m[k]:.3f} m "
            f"within {1e3 * period_s[k]:.0f} ms{_more(len(jumps))}: did the tracker lose it? "
            "Take these samples out, or leave the demonstration out",
            may_be_accepted=True,
        )
    elif usual_m_s > fast:
        yield Finding(
            False,
            f"{shown.name}: the hand goes at {usual_m_s:.3g} m/s, the robot at "
            f"{limits.speed_limit_m_s:g} m/s at most: see that its times are seconds and its "
            "positions meters",
        )


def _sudden_turns(shown: Demonstration) -> Iterator[Finding]:
    if shown.orientations is None:
        return
    q = shown.orientations / np.linalg.norm(shown.orientations, axis=1, keepdims=True)
    turned_rad = 2.0 * np.arccos(np.clip(np.abs((q[1:] * q[:-1]).sum(axis=1)), 0.0, 1.0))
    period_s = _longest_periods(shown.time_s)
    far = (turned_rad > LARGEST_TURN_RAD) & (turned_rad / period_s > FASTEST_TURN_RAD_S)
    jumps = np.flatnonzero(far & _counts(shown))
    if len(jumps):
        k = int(jumps[0])
        yield Finding(
            True,
            f"{shown.name}: at {shown.time_s[k + 1]:.3f} s the hand turns by "
            f"{np.degrees(turned_rad[k]):.0f}° within {1e3 * period_s[k]:.0f} ms"
            f"{_more(len(jumps))}: did the tracker lose it? Take these samples out, or leave the "
            "demonstration out",
            may_be_accepted=True,
        )


def _outside(task: Task, shown: Demonstration) -> Iterator[Finding]:
    """Where the way leads out of the workspace, wherever in it the hand began.

    Positions are the hand's, in coordinates of its own; the robot makes the same way from its own
    beginning.
    """
    lower, upper = np.array(task.workspace.lower_m), np.array(task.workspace.upper_m)
    slack_m = JUMP_STEPS * task.dead_zone_m
    too_long = np.ptp(shown.positions, axis=0) - (upper - lower)
    if (too_long > slack_m).any():
        axis = int(too_long.argmax())
        yield Finding(
            False,
            f"{shown.name}: its way spans {np.ptp(shown.positions[:, axis]):.2f} m along "
            f"{'xyz'[axis]}, the workspace {upper[axis] - lower[axis]:.2f} m: the robot cannot "
            "make it; show it smaller, or make the workspace larger",
        )
        return
    first = next((label for label in shown.states if label is not None), None)
    if first is None or first.partition("/")[0] not in task.start:
        return
    begin = next(k for k, label in enumerate(shown.states) if label is not None)
    way = shown.positions - shown.positions[begin] + np.array(task.robot.tool_start_m)
    beyond = np.maximum(np.maximum(lower - way, way - upper), 0.0)
    beyond[~np.append(_counts(shown), shown.states[-1] is not None)] = 0.0
    far_m = beyond.max(axis=1)
    if far_m.max() > slack_m:
        k, axis = int(far_m.argmax()), int(beyond[far_m.argmax()].argmax())
        yield Finding(
            False,
            f"{shown.name}: begun at tool_start_m, its way leaves the workspace by "
            f"{far_m[k]:.2f} m along {'xyz'[axis]} at {shown.time_s[k]:.1f} s, and the robot stops "
            "there: show it smaller, or make the workspace larger",
        )


def _wrong_times(limits: Limits, shown: Demonstration) -> Iterator[Finding]:
    if seems_other_times(limits, shown):
        steps = steps_of(shown.positions, limits.dead_zone_m)
        lasts_s = float(shown.time_s[-1] - shown.time_s[0])
        yield Finding(
            False,
            f"{shown.name}: it lasts {lasts_s:.4g} s for a way of {length_of(steps):.2f} m: are "
            "its times in milliseconds or nanoseconds? Give seconds",
        )


def _gaps(limits: Limits, shown: Demonstration) -> Iterator[Finding]:
    period_s, moved_m, _ = _motion(shown, np.diff(shown.time_s))
    usual_s = float(np.median(period_s))
    if (period_s <= 2.0 * usual_s).mean() < REGULAR_SHARE:
        return
    long = period_s > max(LONGEST_GAP_S, GAP_PERIODS * usual_s)
    gaps = np.flatnonzero(long & (moved_m >= JUMP_STEPS * limits.dead_zone_m) & _counts(shown))
    if len(gaps):
        k = int(gaps[0])
        yield Finding(
            False,
            f"{shown.name}: there is no sample from {shown.time_s[k]:.2f} s to "
            f"{shown.time_s[k + 1]:.2f} s, and the hand moved {moved_m[k]:.2f} m meanwhile"
            f"{_more(len(gaps))}: the way is straight there; leave it out, if that was not meant",
        )


class _SampledSpeeds(NamedTuple):
    period_s: Array
    """From each sample to the next, shape (T − 1,)."""
    moved_m: Array
    speed_m_s: Array


def _longest_periods(time_s: Array) -> Array:
    """How long the hand may have had from each sample to the next, s, shape (T − 1,).

    A recorder that was held up writes several samples at once: any of them may have been taken
    just after the last one before.
    """
    period_s = np.diff(time_s)
    short = period_s < 0.5 * np.median(period_s)
    longest = period_s.copy()
    since = 0
    for k in range(len(period_s)):
        if k and not short[k]:
            since = k
        longest[k] = time_s[k + 1] - time_s[since]
    return longest


def _motion(shown: Demonstration, period_s: Array) -> _SampledSpeeds:
    moved_m = np.linalg.norm(np.diff(shown.positions, axis=0), axis=1)
    return _SampledSpeeds(period_s, moved_m, moved_m / period_s)


def length_of(steps: Iterable[Step]) -> float:
    """Return the length of a way in steps, m, to which noise adds nothing, at whatever rate."""
    return float(sum(np.linalg.norm(step.displacement) for step in steps))


def _counts(shown: Demonstration) -> NDArray[np.bool_]:
    """Whether what happens from a sample to the next is learned from, shape (T − 1,)."""
    labeled = np.array([label is not None for label in shown.states])
    return labeled[:-1] if labeled.any() else np.ones(len(labeled) - 1, dtype=bool)


def _more(count: int) -> str:
    return f" (and {count - 1} times more)" if count > 1 else ""
