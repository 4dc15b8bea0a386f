"""Stretches of a recording, each one state of the task: checked, set anew, taken away.

Stretches of one recording never overlap and stand in the order of time. An editor of them, on a
page or by a command, does it by these functions; no file is known here.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

from hmcs.errors import UserError

NS_PER_S = 1_000_000_000
_SLACK_NS = 1_000_000
"""So far a label may reach beyond the last message: what shows it may have rounded."""
_UNITS = (("seconds", 1), ("milliseconds", 10**3), ("microseconds", 10**6), ("nanoseconds", 10**9))
_LEAST_SHARE = 0.05
"""Of a recording that labels in another unit reach over; who means its end writes less."""
_SINCE_1970_S = (1e9, 4e9)
"""Seconds since 1970 from 2001 to 2096."""


class LabelError(UserError):
    """Labels that cannot be of a recording; says which, when and why."""


class Stretch(NamedTuple):
    """A stretch of a recording that is one state of the task."""

    begin_ns: int
    """ns since 1970, as messages are logged; or since any other moment, the same for all."""
    end_ns: int
    """The first moment that is not in it."""
    state: str
    """A task state, or `state/gesteme`."""


def relabeled(stretches: Iterable[Stretch], new: Stretch) -> tuple[Stretch, ...]:
    """Return the stretches with a new one, in order; what it overlaps is cut.

    Neighbors of one state without a moment between become one. Raises LabelError where the new one
    does not begin before it ends, or says nothing.
    """
    new = new._replace(state=new.state.strip())
    _check_one(new)
    return _joined([*cleared(stretches, new.begin_ns, new.end_ns), new])


def cleared(stretches: Iterable[Stretch], begin_ns: int, end_ns: int) -> tuple[Stretch, ...]:
    """Return the stretches without what lies from `begin_ns` up to `end_ns`, in order."""
    kept = []
    for stretch in stretches:
        before = stretch._replace(end_ns=min(stretch.end_ns, begin_ns))
        after = stretch._replace(begin_ns=max(stretch.begin_ns, end_ns))
        parts = (before, after) if begin_ns < end_ns else (stretch,)
        kept += [part for part in parts if part.begin_ns < part.end_ns]
    return tuple(sorted(kept))


def of_seconds(
    begin_s: Sequence[float], end_s: Sequence[float], states: Sequence[str], first_ns: int = 0
) -> tuple[Stretch, ...]:
    """Return stretches given in seconds since `first_ns`.

    Raises LabelError where there are not as many of each, one is not finite, does not begin before
    it ends, says nothing, or begins before the one ahead of it has ended.
    """
    if not len(begin_s) == len(end_s) == len(states):
        raise LabelError(
            f"{len(begin_s)} labels begin, {len(end_s)} end, and {len(states)} say what they are: "
            "give all three of each"
        )
    stretches = []
    for begin, end, state in zip(begin_s, end_s, states, strict=True):
        if not (math.isfinite(begin) and math.isfinite(end)):
            raise LabelError(f"label {state!r} from {begin} s to {end} s: give finite seconds")
        stretches.append(Stretch(first_ns + to_ns(begin), first_ns + to_ns(end), state.strip()))
    for stretch in stretches:
        _check_one(stretch, first_ns)
    for one, other in pairwise(stretches):
        if other.begin_ns < one.end_ns:
            raise LabelError(
                f"label {stretch_text(other, first_ns)} begins before "
                f"{stretch_text(one, first_ns)} ends: let each end where the next one begins, "
                "in the order of time"
            )
    return tuple(stretches)


def check_within(stretches: Iterable[Stretch], first_ns: int, last_ns: int) -> None:
    """Raise LabelError for a stretch that leaves a recording from `first_ns` to `last_ns`."""
    for stretch in stretches:
        if stretch.begin_ns < first_ns or ends_after(stretch, last_ns):
            raise LabelError(
                f"label {stretch_text(stretch, first_ns)} is outside of the recording, which lasts "
                f"{(last_ns - first_ns) / NS_PER_S:.3f} s: label what is in it"
            )


def ends_after(stretch: Stretch, last_ns: int) -> bool:
    """Return whether a stretch ends after a recording whose last message is of `last_ns`."""
    return stretch.end_ns > last_ns + _SLACK_NS


def misread_unit(stretches: Sequence[Stretch], first_ns: int, last_ns: int | None) -> str:
    """Return in which unit the times of stretches seem to have been written instead of seconds.

    With what to do about it; empty where they can be of a recording from `first_ns` to `last_ns`,
    or nobody can tell. `last_ns` is None where its end is not known.
    """
    latest_s = max((stretch.end_ns - first_ns for stretch in stretches), default=0) / NS_PER_S
    for unit, in_second in _UNITS:
        if _SINCE_1970_S[0] <= latest_s / in_second <= _SINCE_1970_S[1]:
            return (
                f"{unit} since 1970: write seconds since the recording began, which was "
                f"{first_ns / NS_PER_S:.3f} s since then"
            )
    if last_ns is None:
        return ""
    lasts_s = (last_ns - first_ns) / NS_PER_S
    for unit, in_second in _UNITS[1:]:
        if (
            latest_s > 2 * lasts_s
            and _LEAST_SHARE * lasts_s <= latest_s / in_second <= lasts_s + 1.0
        ):
            return f"{unit}: divide them by {in_second}"
    return ""


def to_ns(seconds: float) -> int:
    """Return seconds as whole ns."""
    return round(seconds * NS_PER_S)


def stretch_text(stretch: Stretch, first_ns: int = 0) -> str:
    """Return a stretch as people read it, in seconds since `first_ns`."""
    begin_s, end_s = ((at - first_ns) / NS_PER_S for at in stretch[:2])
    return f"{stretch.state!r} from {begin_s:.3f} s to {end_s:.3f} s"


def _check_one(stretch: Stretch, first_ns: int = 0) -> None:
    if not stretch.state or not stretch.state.isprintable():
        raise LabelError(f"label {stretch_text(stretch, first_ns)}: give it the name of a state")
    if stretch.begin_ns >= stretch.end_ns:
        raise LabelError(f"label {stretch_text(stretch, first_ns)}: let it begin before it ends")


def _joined(stretches: Iterable[Stretch]) -> tuple[Stretch, ...]:
    joined: list[Stretch] = []
    for stretch in sorted(stretches):
        last = joined[-1] if joined else None
        if last is not None and (last.end_ns, last.state) == (stretch.begin_ns, stretch.state):
            joined[-1] = last._replace(end_ns=stretch.end_ns)
        else:
            joined.append(stretch)
    return tuple(joined)
