"""A recording as the page shows it: its motion, its labels as they are being set, what is chosen.

Times are s since the recording's first message, as its outline has them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.arrays import Array
from hmcs.bus.messages import Outline, SetLabels
from hmcs.recordings.stretches import (
    NS_PER_S,
    LabelError,
    Stretch,
    cleared,
    of_seconds,
    relabeled,
    stretch_text,
    to_ns,
)
from hmcs_console.shapes.palette import UNKNOWN, Color, color_of
from hmcs_console.shapes.pieces import Pieces

CHOSEN: Color = (60, 60, 60)
MOST = 1e7
"""Seconds, and meters, that no recording has."""
MOST_STATES = 100
"""That labels of a recording name; each is drawn."""
_WHILE_S = 0.2


class Found(NamedTuple):
    """The parts of a recording as a model found them afterwards."""

    model: str
    """Its name."""
    segments: tuple[Stretch, ...]
    """One after another; without a state where the motion is unknown."""
    probability: tuple[float, ...]
    """Of each."""


class Take(NamedTuple):
    """What is shown of a recording; none where `name` is empty."""

    recordings: tuple[str, ...] = ()
    """All there are, the newest first."""
    name: str = ""
    path: str = ""
    """As the recorder sees it."""
    duration_s: float = 0.0
    time_s: Array = np.zeros(0)
    """Shape (n,)."""
    position: Array = np.zeros((0, 3))
    """Of the hand, m, operator frame, shape (n, 3)."""
    labels: tuple[Stretch, ...] = ()
    """As they are now, saved or not."""
    chosen_s: tuple[float, float] = (0.0, 0.0)
    """From where to where the next label is to be set."""
    unsaved: Mapping[str, tuple[Stretch, ...]] = MappingProxyType({})
    """Labels that were set and not saved, by recording."""
    note: str = ""
    """What somebody wrote down about it."""
    found: Found | None = None
    """Its parts by a model; None as long as none was asked."""
    playing_since_s: float | None = None
    """When its playing in the scene began, monotonic; None while it is not played."""
    said: str = ""
    """What came of the last thing that was done."""


def opened(take: Take, outline: Outline) -> Take:
    """Return what is shown once an outline has come; labels that were not saved are kept.

    Raises LabelError where the outline contradicts itself.
    """
    if len(outline.time_s) != len(outline.position):
        raise LabelError(f"{outline.recording}: not a position for each time in its outline")
    numbers = (outline.time_s, outline.begin_s, outline.end_s, outline.position.ravel())
    if outline.duration_s > MOST or any(np.abs(each).max(initial=0.0) > MOST for each in numbers):
        raise LabelError(f"{outline.recording}: times and positions of no recording")
    if len(set(outline.states)) > MOST_STATES:
        raise LabelError(f"{outline.recording}: its labels name more than {MOST_STATES} states")
    labels = of_seconds(outline.begin_s.tolist(), outline.end_s.tolist(), outline.states)
    again = take.name == outline.recording
    return take._replace(
        recordings=outline.recordings,
        name=outline.recording,
        path=outline.path,
        duration_s=outline.duration_s,
        time_s=outline.time_s,
        position=outline.position,
        note=outline.note,
        found=take.found if again else None,
        playing_since_s=take.playing_since_s if again else None,
        labels=take.unsaved.get(outline.recording, labels),
        chosen_s=_within(take.chosen_s, outline.duration_s) if again else (0.0, outline.duration_s),
        said="" if len(outline.time_s) else "no motion of a hand that held on is in it",
    )


def hidden(take: Take) -> Take:
    """Return what is shown once the recording is put away; what was not saved is kept."""
    return Take(recordings=take.recordings, unsaved=take.unsaved)


def labeled(take: Take, state: str) -> Take:
    """Return the recording with the chosen stretch labeled, or saying why it cannot be."""
    begin_s, end_s = take.chosen_s
    new = Stretch(to_ns(begin_s), to_ns(end_s), state)
    try:
        return _edited(take, relabeled(take.labels, new), stretch_text(new))
    except LabelError as error:
        return take._replace(said=str(error))


def unlabeled(take: Take) -> Take:
    """Return the recording without labels in the chosen stretch."""
    begin_s, end_s = take.chosen_s
    rest = cleared(take.labels, to_ns(begin_s), to_ns(end_s))
    return _edited(take, rest, f"no label from {begin_s:.3f} s to {end_s:.3f} s")


def saving(take: Take) -> SetLabels:
    """Return what the recorder is asked to write down."""
    at_s = np.array([label[:2] for label in take.labels], dtype=float).reshape(-1, 2) / NS_PER_S
    return SetLabels(
        recording=take.name,
        begin_s=at_s[:, 0].copy(),
        end_s=at_s[:, 1].copy(),
        states=tuple(label.state for label in take.labels),
    )


def saved(take: Take, asked: SetLabels, said: str) -> Take:
    """Return the recording once the recorder has written down what it was asked to."""
    written = of_seconds(asked.begin_s.tolist(), asked.end_s.tolist(), asked.states)
    # Labels may have been set while it wrote.
    kept = {
        name: labels
        for name, labels in take.unsaved.items()
        if (name, labels) != (asked.recording, written)
    }
    return take._replace(unsaved=kept, said=said)


def states_of(take: Take, states: Sequence[str]) -> tuple[str, ...]:
    """Return the states of the task, and whatever else the labels name."""
    named = sorted({label.state for label in take.labels} - set(states))
    return (*states, *named)


def bands(take: Take, states: Sequence[str]) -> tuple[Array, ...]:
    """Return what is plotted, each of shape (k,): times, speeds, the chosen stretch, each state.

    A state is as high as the highest speed where it is labeled, else 0; the chosen stretch is a
    fifth of that.
    """
    edges = [edge for label in take.labels for edge in _edges(*(at / NS_PER_S for at in label[:2]))]
    frame = (0.0, take.duration_s)
    times = np.unique(np.concatenate([take.time_s, frame, edges, _edges(*take.chosen_s)]))
    speeds = _speeds(take, times)
    height = float(speeds.max(initial=0.0)) or 1.0
    labels = _labels_at(take, times)
    begin_s, end_s = take.chosen_s
    chosen = height / 5 * ((times >= begin_s) & (times < end_s))
    return (times, speeds, chosen, *(height * (labels == state) for state in states))


def lines(take: Take, states: Sequence[str], origin: Array) -> tuple[Pieces, Pieces]:
    """Return the way of the hand, laid to begin at `origin`, m, (3,); whole, and what is chosen."""
    if len(take.time_s) < 2:
        none = Pieces(np.zeros((0, 2, 3), np.float32), np.zeros((0, 2, 3), np.uint8))
        return none, none
    way = (take.position - take.position[0] + origin).astype(np.float32)
    pieces = np.stack([way[:-1], way[1:]], axis=1)
    middle = (take.time_s[:-1] + take.time_s[1:]) / 2
    of_state = {label.state: band_color(label.state, states) for label in take.labels}
    colors = np.array(
        [of_state.get(state, UNKNOWN) for state in _labels_at(take, middle)], dtype=np.uint8
    )
    both = np.repeat(colors[:, None], 2, axis=1)
    begin_s, end_s = take.chosen_s
    chosen = (middle >= begin_s) & (middle < end_s)
    return Pieces(pieces, both), Pieces(pieces[chosen], both[chosen])


def played_at(take: Take, origin: Array, now_s: float) -> Array | None:
    """Return where the hand is in the scene while the recording is played, m, shape (3,).

    It is laid as `lines` lays it; None where it is not played, or has been to its end.
    """
    if take.playing_since_s is None or len(take.time_s) < 2:
        return None
    at_s = now_s - take.playing_since_s + take.time_s[0]
    if not 0.0 <= at_s <= take.time_s[-1]:
        return None
    place = [np.interp(at_s, take.time_s, axis) for axis in take.position.T]
    return np.asarray(np.array(place) - take.position[0] + origin)


def band_color(state: str, states: Sequence[str]) -> Color:
    """Return the color of a label: that of its state, whatever gesteme it names."""
    return color_of(state.partition("/")[0], states)


def _within(chosen_s: tuple[float, float], duration_s: float) -> tuple[float, float]:
    begin_s, end_s = chosen_s
    return min(begin_s, duration_s), min(end_s, duration_s)


def _edited(take: Take, labels: tuple[Stretch, ...], what: str) -> Take:
    return take._replace(
        labels=labels,
        unsaved={**take.unsaved, take.name: labels},
        said=f"{what}; not saved yet",
    )


def _edges(begin_s: float, end_s: float) -> tuple[float, ...]:
    """Where a band rises and falls: at once, each between two neighboring numbers."""
    return tuple(at for edge in (begin_s, end_s) for at in (np.nextafter(edge, -np.inf), edge))


def _speeds(take: Take, times: Array) -> Array:
    """Of the hand over a little while about each time, lest the jitter of samples counts."""
    if len(take.time_s) < 2:
        return np.zeros(len(times))
    moved_m = np.linalg.norm(np.diff(take.position, axis=0), axis=1)
    way_m = np.append(0.0, np.cumsum(moved_m))
    first_s, last_s = take.time_s[0], take.time_s[-1]
    while_s = min(_WHILE_S, last_s - first_s)
    begin_s = np.clip(times - while_s / 2, first_s, last_s - while_s)
    passed_m = [np.interp(at, take.time_s, way_m) for at in (begin_s, begin_s + while_s)]
    return np.asarray((passed_m[1] - passed_m[0]) / while_s)


def _labels_at(take: Take, times: Array) -> NDArray[np.object_]:
    """What is labeled at some times, empty where nothing is, shape (k,)."""
    found = np.full(len(times), "", dtype=object)
    for label in take.labels:
        begin_s, end_s = (at / NS_PER_S for at in label[:2])
        found[(times >= begin_s) & (times < end_s)] = label.state
    return found
