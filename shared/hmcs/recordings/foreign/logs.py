"""Logs of messages on topics, and the demonstration that is in one.

The motion is taken of one topic: joint positions where a URDF is given, else poses, else velocities
that are integrated. Force and buttons come beside it. A topic that is the only one of its kind is
taken by itself; where there are several a person chooses.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.forward_kinematics import poses, read_chain
from hmcs.motion.quaternions import turned
from hmcs.recordings.foreign.choices import METERS, RADIANS, Choices
from hmcs.recordings.foreign.said import (
    BUTTONS,
    FORCES,
    JOINTS,
    KINDS,
    POSES,
    VELOCITIES,
    Kind,
    Said,
)
from hmcs.recordings.foreign.tracks import Mark, Track, TrackMaker, demonstration_of
from hmcs.recordings.reading import RecordingError
from hmcs.recordings.stretches import NS_PER_S

STANDS_AFTER_S = 0.5
"""A velocity holds no longer than this: who sends none is standing still."""
MOST_JOINTS = 256
_SHOWN_TOPICS = 30


class Topic(NamedTuple):
    """What a log has on a topic."""

    name: str
    type_name: str
    """As ROS 2 names types, e.g. `geometry_msgs/msg/PoseStamped`."""
    kind: Kind | None
    """None where its messages are not read here."""
    size: int
    """How many messages."""


class Message(NamedTuple):
    """A message of a log."""

    topic: str
    log_ns: int
    said: Said


class Log(Protocol):
    """A recording as a row of messages."""

    @property
    def where(self) -> Path:
        """Its file or folder."""
        ...

    def topics(self) -> Sequence[Topic]:
        """Return its topics."""
        ...

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages on some topics in the order of their log times."""
        ...


class FoundMotion(NamedTuple):
    """What a log holds."""

    demonstration: Demonstration
    notes: tuple[str, ...]


class _Chosen(NamedTuple):
    motion: Topic
    force: Topic | None
    buttons: Topic | None
    notes: list[str]

    @property
    def all(self) -> list[Topic]:
        return [each for each in (self.motion, self.force, self.buttons) if each is not None]


def motion_in(log: Log, choices: Choices) -> FoundMotion:
    """Return the demonstration in a log, and what was taken for it.

    Raises RecordingError where no topic has motion, several may be meant, or a sample is none.
    """
    chosen = _chosen(log, choices)
    stamped = _all_stamped(log, chosen)
    where = f"{log.where}: {chosen.motion.name}"
    makers = {topic.name: _maker(log, topic, choices) for topic in chosen.all}
    for message in log.messages(makers.keys()):
        at_ns = message.said.stamp_ns if stamped else message.log_ns
        makers[message.topic].take(at_ns or 0, message.said)
    own = makers[chosen.motion.name]
    motion = own.motion(where)
    force = None if chosen.force is None else makers[chosen.force.name].samples.track()
    marks = () if chosen.buttons is None else tuple(makers[chosen.buttons.name].marks)
    shown, notes = demonstration_of(log.where.name, where, motion, force, marks)
    if own.samples.doubled:
        notes.append(f"{where}: {own.samples.doubled} samples of the time of the next left out")
    clock = "the stamps of its messages" if stamped else "when its messages were recorded"
    said = f"{log.where}: motion of {chosen.motion.name} ({chosen.motion.type_name}), times by "
    beside = [f"force of {chosen.force.name}"] if chosen.force is not None else []
    beside += [f"states of {chosen.buttons.name}"] if chosen.buttons is not None else []
    return FoundMotion(
        shown, (", ".join([said + clock, *beside]), *chosen.notes, *own.notes(where), *notes)
    )


def _chosen(log: Log, choices: Choices) -> _Chosen:
    topics = [topic for topic in log.topics() if topic.size]
    named = [_named(log, topics, name) for name in choices.topics]
    motion_kinds = (JOINTS,) if choices.urdf is not None else (POSES, VELOCITIES)
    asked = [topic for topic in named if topic.kind in (*motion_kinds, JOINTS)]
    if any(topic.kind == JOINTS for topic in asked) and choices.urdf is None:
        raise RecordingError(
            f"{log.where}: {asked[0].name} has joint positions: name the robot's description by "
            "--urdf FILE"
        )
    candidates = asked or next(
        (
            found
            for kind in motion_kinds
            if (found := [topic for topic in topics if topic.kind == kind])
        ),
        [],
    )
    if not candidates:
        raise RecordingError(f"{log.where}: {_no_motion(topics, choices)}")
    if len(candidates) > 1:
        raise RecordingError(
            f"{log.where}: which topic is the motion? Name one by --topic: {_listed(candidates)}"
        )
    notes = list[str]()
    force = _beside(log, topics, named, FORCES, notes)
    buttons = _beside(log, topics, named, BUTTONS, notes) if choices.marks else None
    if choices.marks and buttons is None:
        raise RecordingError(
            f"{log.where}: has no one topic of sensor_msgs/msg/Joy that --marks could be of; it "
            f"has {_listed(topics)}"
        )
    return _Chosen(candidates[0], force, buttons, notes)


def _named(log: Log, topics: Sequence[Topic], name: str) -> Topic:
    found = next((topic for topic in topics if topic.name in (name, f"/{name}")), None)
    if found is None:
        raise RecordingError(f"{log.where}: has no messages on {name!r}; it has {_listed(topics)}")
    if found.kind is None:
        raise RecordingError(
            f"{log.where}: {name} is of {found.type_name or 'no known type'}; what is read are "
            f"{', '.join(KINDS)}"
        )
    return found


def _no_motion(topics: Sequence[Topic], choices: Choices) -> str:
    if choices.urdf is not None:
        return f"has no joint positions for {choices.urdf}; it has {_listed(topics)}"
    if any(topic.kind == JOINTS for topic in topics):
        return (
            "has joint positions, but no poses and no velocities: name the robot's description by "
            "--urdf FILE"
        )
    return (
        f"has no poses, velocities or joint positions; it has {_listed(topics)}; what is read are "
        f"{', '.join(KINDS)}"
    )


def _beside(
    log: Log, topics: Sequence[Topic], named: Sequence[Topic], kind: Kind, notes: list[str]
) -> Topic | None:
    """The topic of a kind that was named, or that is the only one."""
    found = [topic for topic in named if topic.kind == kind]
    found = found or [topic for topic in topics if topic.kind == kind]
    if len(found) > 1:
        notes.append(
            f"{log.where}: several topics of {kind} ({_listed(found)}): none is read; name one by "
            "--topic"
        )
    return found[0] if len(found) == 1 else None


def _listed(topics: Sequence[Topic]) -> str:
    shown = [f"{each.name} ({each.type_name}, {each.size})" for each in topics[:_SHOWN_TOPICS]]
    more = len(topics) - _SHOWN_TOPICS
    return ", ".join([*shown, *([f"{more} more"] if more > 0 else [])]) or "no messages"


def _all_stamped(log: Log, chosen: _Chosen) -> bool:
    """Whether the first message on every topic carries the time at which it was taken."""
    return all(_first(log, topic).said.stamp_ns for topic in chosen.all)


def _first(log: Log, topic: Topic) -> Message:
    first = next(iter(log.messages([topic.name])), None)
    if first is None:
        raise RecordingError(f"{log.where}: {topic.name}: has no message that can be read")
    return first


class _Maker:
    """Makes tracks of the messages on one topic."""

    def __init__(self, where: str, width: int) -> None:
        self.samples = TrackMaker(where, width)
        self.marks = list[Mark]()
        self._where = where
        self._frame: str | None = None

    def take(self, at_ns: int, said: Said) -> None:
        if self._frame is None:
            self._frame = said.frame
        elif said.frame != self._frame:
            raise RecordingError(
                f"{self._where}: is in frame {self._frame!r} first and in {said.frame!r} at "
                f"message {len(self.samples) + 1}: a demonstration has one frame; name another "
                "topic by --topic"
            )
        self._add(at_ns, said)

    def motion(self, where: str) -> Track:
        return self.samples.track()

    def notes(self, where: str) -> list[str]:
        return []

    def _add(self, at_ns: int, said: Said) -> None:
        self.samples.add(at_ns, said.numbers)


class _Velocities(_Maker):
    def motion(self, where: str) -> Track:
        return _integrated(self.samples.track())

    def notes(self, where: str) -> list[str]:
        return [
            f"{where}: velocities in frame {self._frame or '(none)'!r} are integrated from 0, as "
            "if that frame stood still"
        ]


class _Joints(_Maker):
    def __init__(self, where: str, choices: Choices) -> None:
        assert choices.urdf is not None
        self._chain = read_chain(choices.urdf, choices.link)
        self._choices = choices
        super().__init__(where, len(self._chain.names))

    def motion(self, where: str) -> Track:
        track = self.samples.track()
        angle, length = RADIANS[self._choices.angle or "rad"], METERS[self._choices.length or "m"]
        scale = [angle if name in self._chain.turning else length for name in self._chain.names]
        places, turns = poses(self._chain, self._chain.names, track.values * scale)
        return Track(track.time_ns, np.hstack([places, turns]))

    def notes(self, where: str) -> list[str]:
        return [f"{where}: positions of link {self._chain.link!r} of {self._chain.file}"]

    def _add(self, at_ns: int, said: Said) -> None:
        if len(said.names) > MOST_JOINTS or len(said.names) != len(said.numbers):
            raise RecordingError(
                f"{self._where}: message {len(self.samples) + 1} names {len(said.names)} joints "
                f"and has {len(said.numbers)} positions, expected as many, at most {MOST_JOINTS}"
            )
        there = dict(zip(said.names, said.numbers, strict=True))
        missing = [name for name in self._chain.names if name not in there]
        if len(missing) == len(self._chain.names) and len(self.samples) == 0 and there:
            raise RecordingError(
                f"{self._where}: names the joints {', '.join(said.names[:20])}, "
                f"{self._chain.file} needs {', '.join(missing[:20])}: is it another robot's?"
            )
        if missing:
            raise RecordingError(
                f"{self._where}: message {len(self.samples) + 1} has no position of "
                f"{', '.join(missing[:20])}: name another link by --link, or another topic"
            )
        self.samples.add(at_ns, [there[name] for name in self._chain.names])


class _Buttons(_Maker):
    def __init__(self, where: str, states: Mapping[int, str]) -> None:
        super().__init__(where, 0)
        self._states = states
        self._held: set[int] = set()

    def _add(self, at_ns: int, said: Said) -> None:
        held = {number for number, pressed in enumerate(said.numbers) if pressed}
        for number in sorted(held - self._held):
            if number in self._states:
                self.marks.append(Mark(at_ns, self._states[number]))
        self._held = held


def _maker(log: Log, topic: Topic, choices: Choices) -> _Maker:
    where = f"{log.where}: {topic.name}"
    makers: Mapping[Kind | None, Callable[[], _Maker]] = {
        JOINTS: lambda: _Joints(where, choices),
        VELOCITIES: lambda: _Velocities(where, 6),
        FORCES: lambda: _Maker(where, 6),
        BUTTONS: lambda: _Buttons(where, choices.marks),
    }
    if topic.kind in makers:
        return makers[topic.kind]()
    return _Maker(where, len(_first(log, topic).said.numbers))


def _integrated(twists: Track) -> Track:
    """The pose that velocities, shape (T, 6), lead to from the origin, shape (T, 7)."""
    period_s = np.diff(twists.time_ns) / NS_PER_S
    holds_s = np.where(period_s > STANDS_AFTER_S, 0.0, period_s)
    linear, angular = twists.values[:, :3], twists.values[:, 3:]
    moved = 0.5 * (linear[1:] + linear[:-1]) * holds_s[:, None]
    places = np.vstack([np.zeros(3), np.cumsum(moved, axis=0)])
    turns: list[Array] = [np.array([0.0, 0.0, 0.0, 1.0])]
    for velocity, lasts_s in zip(0.5 * (angular[1:] + angular[:-1]), holds_s, strict=True):
        still = not math.hypot(*velocity)
        turns.append(turns[-1] if still else turned(turns[-1], velocity, float(lasts_s)))
    return Track(twists.time_ns, np.hstack([places, np.array(turns[: len(places)])]))
