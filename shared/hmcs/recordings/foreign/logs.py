"""Logs of messages on topics, and the demonstration that is in one.

The motion is taken of one topic: joint positions where a URDF is given, else poses, else velocities
that are integrated. Force and buttons come beside it. A topic that is the only one of its kind is
taken by itself; where there are several a person chooses.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

from hmcs.motion.demonstrations import Demonstration
from hmcs.recordings.foreign.choices import Choices
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
from hmcs.recordings.foreign.sensors import ButtonSensor, JointSensor, Sensor, VelocitySensor
from hmcs.recordings.foreign.tracks import demonstration_of
from hmcs.recordings.reading import RecordingError

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
    motion = own.motion()
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
        shown, (", ".join([said + clock, *beside]), *chosen.notes, *own.notes(), *notes)
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


def _maker(log: Log, topic: Topic, choices: Choices) -> Sensor:
    where = f"{log.where}: {topic.name}"
    makers: Mapping[Kind | None, Callable[[], Sensor]] = {
        JOINTS: lambda: JointSensor(where, choices),
        VELOCITIES: lambda: VelocitySensor(where, 6),
        FORCES: lambda: Sensor(where, 6),
        BUTTONS: lambda: ButtonSensor(where, choices.marks),
    }
    if topic.kind in makers:
        return makers[topic.kind]()
    return Sensor(where, len(_first(log, topic).said.numbers))
