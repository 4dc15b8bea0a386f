"""Sensors of a log: the track that the messages on one topic make, by what they say."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.forward_kinematics import poses, read_chain
from hmcs.motion.quaternions import turned
from hmcs.recordings.foreign.choices import METERS, RADIANS, Choices
from hmcs.recordings.foreign.said import Said
from hmcs.recordings.foreign.tracks import Mark, Track, TrackMaker
from hmcs.recordings.reading import RecordingError
from hmcs.recordings.stretches import NS_PER_S

STANDS_AFTER_S = 0.5
"""A velocity holds no longer than this: who sends none is standing still."""
MOST_JOINTS = 256


class Sensor:
    """Makes a track of the messages on one topic, each of `width` numbers."""

    def __init__(self, where: str, width: int) -> None:
        self.samples = TrackMaker(where, width)
        self.marks = list[Mark]()
        self._where = where
        self._frame: str | None = None

    def take(self, at_ns: int, said: Said) -> None:
        """Take in one more message; RecordingError as `TrackMaker.add`, and for another frame."""
        if self._frame is None:
            self._frame = said.frame
        elif said.frame != self._frame:
            raise RecordingError(
                f"{self._where}: is in frame {self._frame!r} first and in {said.frame!r} at "
                f"message {len(self.samples) + 1}: a demonstration has one frame; name another "
                "topic by --topic"
            )
        self._add(at_ns, said)

    def motion(self) -> Track:
        """Return the motion that the messages are of."""
        return self.samples.track()

    def notes(self) -> list[str]:
        """Return what should be known of it."""
        return []

    def _add(self, at_ns: int, said: Said) -> None:
        self.samples.add(at_ns, said.numbers)


class VelocitySensor(Sensor):
    """Velocities, which are integrated."""

    def motion(self) -> Track:
        """Return the pose they lead to from the origin."""
        return _integrated(self.samples.track())

    def notes(self) -> list[str]:
        """Return how they are integrated."""
        return [
            f"{self._where}: velocities in frame {self._frame or '(none)'!r} are integrated from "
            "0, as if that frame stood still"
        ]


class JointSensor(Sensor):
    """Joint positions, of which the pose of a link follows."""

    def __init__(self, where: str, choices: Choices) -> None:
        assert choices.urdf is not None
        self._chain = read_chain(choices.urdf, choices.link)
        self._choices = choices
        super().__init__(where, len(self._chain.names))

    def motion(self) -> Track:
        """Return the poses of the link."""
        track = self.samples.track()
        angle, length = RADIANS[self._choices.angle or "rad"], METERS[self._choices.length or "m"]
        scale = [angle if name in self._chain.turning else length for name in self._chain.names]
        places, turns = poses(self._chain, self._chain.names, track.values * scale)
        return Track(track.time_ns, np.hstack([places, turns]))

    def notes(self) -> list[str]:
        """Return which link it is."""
        return [f"{self._where}: positions of link {self._chain.link!r} of {self._chain.file}"]

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


class ButtonSensor(Sensor):
    """Buttons, some of which mark a state."""

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
