"""A demonstration, played as if a hand moved the device."""

from __future__ import annotations

from bisect import bisect_right
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.quaternions import continuous
from hmcs_input_device.sources import LIVE, DeviceSample

LEAST_RATE_HZ = 30.0
MOST_RATE_HZ = 1000.0
PRESSED_S = 0.3
"""How long the pedal is down to mark a switch; a busy machine is seldom later with a sample."""


class Passes(NamedTuple):
    """How a demonstration is played."""

    speed: float = 1.0
    """How many times as fast as it was made."""
    repeat: int = 1
    """How many passes; 0 for ever."""
    lead_in_s: float = 1.0
    """How long the hand rests with the dead-man released before each pass."""
    velocity_window_s: float = 0.02
    """Velocities are differences over so much time before and after."""
    mark_switches: bool = False
    """Whether the pedal goes down wherever another label begins."""


class Playback:
    """Plays a demonstration: the dead-man is held while it moves, and released around that.

    A pass is the lead-in, at rest where the motion begins, and the motion. Before it plays, and
    when it has played, the device is at rest with the dead-man released, and nobody pushes it.
    """

    plays = True

    def __init__(self, demonstration: Demonstration, passes: Passes) -> None:
        time_s = (demonstration.time_s - demonstration.time_s[0]) / passes.speed
        self._times_s: list[float] = time_s.tolist()
        self._positions = demonstration.positions
        self._wrenches = demonstration.wrenches
        quaternions = demonstration.orientations
        self._orientations = None if quaternions is None else continuous(quaternions)
        self._passes = passes
        switches_s = time_s[demonstration.switches] if passes.mark_switches else np.zeros(0)
        # Between two switches that are close the pedal must come up, or nobody sees the second.
        pressed_s = np.minimum(PRESSED_S, np.diff(switches_s, append=np.inf) / 2)
        self._pressed_s: list[float] = np.round(switches_s, 9).tolist()
        self._released_s: list[float] = (switches_s + pressed_s).tolist()
        own_hz = 1.0 / float(np.median(np.diff(time_s)))
        self._rate_hz = min(max(own_hz, LEAST_RATE_HZ), MOST_RATE_HZ)

    @property
    def rate_hz(self) -> float:
        """Samples a second: as many as the demonstration has, within what a device has."""
        return self._rate_hz

    @property
    def pass_s(self) -> float:
        """How long a pass takes, with its lead-in."""
        return self._passes.lead_in_s + self._times_s[-1]

    @property
    def duration_s(self) -> float:
        """How long all passes take; LIVE where they do not end."""
        return self.pass_s * self._passes.repeat if self._passes.repeat else LIVE

    @property
    def reach_m(self) -> float:
        """How far the motion goes from where it begins."""
        return float(np.linalg.norm(self._positions - self._positions[0], axis=1).max())

    def sample(self, elapsed_s: float | None) -> DeviceSample:
        """Return the device `elapsed_s` after the request to play."""
        if elapsed_s is None or elapsed_s < 0:
            return self._at_rest(0)
        if elapsed_s > self.duration_s:
            return self._at_rest(-1)
        # The last pass ends on its own last sample, not on the first one of another.
        done = int(elapsed_s / self.pass_s)
        if self._passes.repeat:
            done = min(done, self._passes.repeat - 1)
        moving_s = elapsed_s - done * self.pass_s - self._passes.lead_in_s
        if moving_s < 0:
            return self._at_rest(0)
        return DeviceSample(
            self._at(moving_s, self._positions),
            self._velocity(moving_s),
            dead_man=True,
            pedal=self._pedal(moving_s),
            orientation=self._orientation(moving_s),
            wrench=None if self._wrenches is None else self._at(moving_s, self._wrenches),
        )

    def close(self) -> None:
        """Nothing is held."""

    def _at_rest(self, index: int) -> DeviceSample:
        return DeviceSample(
            self._positions[index],
            np.zeros(3),
            dead_man=False,
            orientation=None if self._orientations is None else self._orientations[index],
            wrench=None if self._wrenches is None else np.zeros(6),
        )

    def _at(self, moving_s: float, recorded: Array) -> Array:
        behind = min(bisect_right(self._times_s, moving_s), len(self._times_s) - 1) - 1
        begin_s, end_s = self._times_s[behind : behind + 2]
        share = min((moving_s - begin_s) / (end_s - begin_s), 1.0)
        return np.asarray((1.0 - share) * recorded[behind] + share * recorded[behind + 1])

    def _orientation(self, moving_s: float) -> Array | None:
        if self._orientations is None:
            return None
        between = self._at(moving_s, self._orientations)
        return np.asarray(between / np.linalg.norm(between))

    def _pedal(self, moving_s: float) -> bool:
        # Sums of differences must not slip before the sample that begins a label.
        newest = bisect_right(self._pressed_s, round(moving_s, 9)) - 1
        return newest >= 0 and moving_s < self._released_s[newest]

    def _velocity(self, moving_s: float) -> Array:
        window_s = self._passes.velocity_window_s
        before_s = max(moving_s - window_s, 0.0)
        after_s = min(moving_s + window_s, self._times_s[-1])
        moved = self._at(after_s, self._positions) - self._at(before_s, self._positions)
        return np.asarray(moved / (after_s - before_s))
