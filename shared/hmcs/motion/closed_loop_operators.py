"""Simulated operators who close the loop: they see the robot, late, and steer it along a path.

The hand of `operators` runs along its reference whatever the robot does; this one has to be
assisted to be of use, since what it commands depends on where it sees the robot. A pursuit of a
point ahead on the intended path, seen with a visuomotor delay, slowed in curves by the two-thirds
power law (Lacquaniti, Terzuolo and Viviani 1983) and where the robot is off the path, through the
lag of the arm, with noise that grows with speed (Harris and Wolpert 1998), wander and tremor.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.disturbances import Tremor, Wander
from hmcs.motion.paths import Path

BEHIND_M, AHEAD_M = 0.005, 0.008
"""The robot is looked for so far behind and ahead of where it was."""
PLACES = 14
"""So many places are compared..."""
AS_NEAR_M = 0.001
"""...and of those as near as the nearest the farthest is taken: where a path turns back on itself
its operator goes on."""
CURVATURE_REACH_M = 0.01
"""Curvature is that of the path's turn over so much to either side."""
FULL_SPEED_RADIUS_M = 0.05
"""In curves of this radius or more the hand goes at full speed."""
REACHED_M = 0.002
"""A robot so near the point aimed at has come there."""
AIMS = 13
"""So many points ahead are compared to aim at one of them."""
SLOWEST = 0.1
"""No slower than this share of the full speed for a curve, an error or the end alone."""


@dataclass(frozen=True)
class Habits:
    """How an operator perceives and moves.

    Raises ValueError for a number that cannot be.
    """

    speed_m_s: float = 0.15
    """On straight stretches."""
    delay_s: float = 0.175
    """From the robot to the eye to the hand."""
    foresight: float = 0.8
    """The share of their own motion since then that operators reckon with: they know what they
    commanded their hand, not what became of it (Miall et al. 1993)."""
    lag_s: float = 0.06
    """Of the arm: time constant of a first-order lag."""
    look_ahead_m: float = 0.008
    look_ahead_s: float = 0.35
    """The point aimed at is `look_ahead_m` plus so much time of motion ahead."""
    cuts_m: float = 0.0015
    """The point aimed at is never so far ahead that the straight way there would cut more than
    this off the path's curves."""
    careful_at_m: float = 0.015
    """The speed is halved where the robot is seen so far off the path."""
    speed_noise: float = 0.12
    """Standard deviation of the velocity as a share of the speed, over three axes."""
    wander_m_s: float = 0.005
    """Root mean square of a slow drift, over three axes."""
    tremor_m_s: float = 0.012
    """Root mean square of the tremor, over three axes."""
    tremor_band_hz: tuple[float, float] = (8.0, 12.0)
    changes_of_mind_per_m: float = 0.0
    """How often the hand goes back a little before it goes on."""
    goes_back_m: float = 0.025

    def __post_init__(self) -> None:
        for name in ("speed_m_s", "lag_s", "look_ahead_m", "cuts_m", "careful_at_m", "goes_back_m"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} is {getattr(self, name)}, expected more than 0")
        for name in (
            "delay_s",
            "foresight",
            "look_ahead_s",
            "speed_noise",
            "wander_m_s",
            "tremor_m_s",
            "changes_of_mind_per_m",
        ):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name} is {getattr(self, name)}, expected 0 or more")
        low, high = self.tremor_band_hz
        if not 0 < low <= high:
            raise ValueError(f"tremor_band_hz is {self.tremor_band_hz}, expected 0 < low <= high")


STEADY = Habits()
PRESETS: Mapping[str, Habits] = {
    "steady": STEADY,
    "novice": replace(
        STEADY,
        speed_m_s=0.1,
        delay_s=0.25,
        look_ahead_s=0.45,
        speed_noise=0.25,
        wander_m_s=0.01,
        changes_of_mind_per_m=1.0,
    ),
    "tremor": replace(STEADY, speed_m_s=0.12, tremor_m_s=0.04),
    "hurried": replace(STEADY, speed_m_s=0.22, delay_s=0.15, speed_noise=0.18, careful_at_m=0.03),
}
"""Operators by name."""


class HandMotion(NamedTuple):
    """What the hand does in one period."""

    velocity: Array
    """Of the hand, m/s, shape (3,)."""
    intended: Array
    """The same without what was not meant, m/s, shape (3,)."""
    progress_m: float
    """How far along the intended path the operator takes the robot to be."""
    arrived: bool
    """Whether the robot is seen at the end of the path, and the hand rests."""


class ClosedLoopOperator:
    """One operator on one path; all that is random is drawn from the generator passed in."""

    def __init__(
        self,
        habits: Habits,
        path: Path,
        rng: np.random.Generator,
        *,
        period_s: float = 0.01,
        arrive_within_m: float = 0.005,
    ) -> None:
        """Intend to lead the robot along `path`, m, in the frame it is seen in."""
        if not period_s > 0:
            raise ValueError(f"period_s is {period_s}, expected more than 0")
        self._habits = habits
        self._path = path
        self._arrive_within_m = arrive_within_m
        self._slow_m, self._slow = _slowing(path)
        # In the order of seeing: what is seen now is the oldest of these.
        self._seen: deque[Array] = deque(maxlen=round(habits.delay_s / period_s) + 1)
        self._told: deque[Array] = deque(maxlen=round(habits.delay_s / period_s))
        self._follow = 1.0 - float(np.exp(-period_s / habits.lag_s))
        self._intended = np.zeros(3)
        self._progress_m = 0.0
        self._speed = 0.0
        self._period_s = period_s
        self._unmeant = Wander(1.0, 0.1, period_s, rng)
        self._wander = Wander(habits.wander_m_s, 0.5, period_s, rng)
        self._tremor = Tremor(habits.tremor_m_s, habits.tremor_band_hz, period_s, rng)
        self._regrets = _regrets(habits, path, rng)
        self._back_to_m: float | None = None

    def step(self, robot: Array) -> HandMotion:
        """Look at the robot, m, shape (3,), and return the hand's motion in the next period."""
        self._seen.append(np.array(robot))
        path, habits = self._path, self._habits
        told_m = self._period_s * np.sum(self._told, axis=0)
        seen = self._seen[0] + habits.foresight * told_m
        off_m = self._go_on(seen)
        to_end_m = float(np.linalg.norm(path.points[-1] - seen))
        arrived = (
            to_end_m <= self._arrive_within_m
            and path.length_m - self._progress_m <= 2.0 * self._arrive_within_m
        )
        wanted = np.zeros(3)
        if not arrived:
            speed = self._wanted_speed(off_m)
            aim_m = self._aim_m(speed)
            aim = path.at(aim_m) - seen
            distance_m = float(np.linalg.norm(aim))
            if distance_m < REACHED_M and aim_m > self._progress_m:
                # The tip of a bend so narrow that both of its sides are as near.
                self._progress_m = aim_m
            # A target that comes near is not overshot: half a second more is taken for the rest.
            speed = min(speed, max(distance_m / habits.look_ahead_s, SLOWEST * speed))
            wanted = speed * aim / max(distance_m, 1e-9)
        self._intended = self._intended + self._follow * (wanted - self._intended)
        self._speed = float(np.linalg.norm(self._intended))
        self._told.append(self._intended)
        velocity = (
            self._intended
            + habits.speed_noise * self._speed * self._unmeant.step()
            + self._wander.step()
            + self._tremor.step()
        )
        return HandMotion(velocity, self._intended, self._progress_m, arrived)

    def _go_on(self, seen: Array) -> float:
        """Find the robot on the path; return how far off it is, m."""
        last_m = self._path.length_m
        reach = np.linspace(-BEHIND_M, AHEAD_M, PLACES)
        places = np.clip(self._progress_m + reach, 0.0, last_m)
        offs = np.linalg.norm(self._path.at(places) - seen, axis=1)
        self._progress_m = float(places[np.flatnonzero(offs <= offs.min() + AS_NEAR_M)[-1]])
        return float(offs.min())

    def _wanted_speed(self, off_m: float) -> float:
        habits = self._habits
        ahead = self._progress_m + habits.look_ahead_m + habits.look_ahead_s * self._speed
        near = (self._slow_m >= self._progress_m) & (self._slow_m <= ahead)
        curve = float(self._slow[near].min(initial=1.0))
        careful = 1.0 / (1.0 + (off_m / habits.careful_at_m) ** 2)
        return habits.speed_m_s * max(curve * careful, SLOWEST)

    def _aim_m(self, speed: float) -> float:
        """Arc length of the point aimed at, with a mind that may have changed."""
        if self._back_to_m is None and self._regrets and self._progress_m >= self._regrets[0]:
            self._back_to_m = self._regrets.pop(0) - self._habits.goes_back_m
        if self._back_to_m is not None:
            if self._progress_m > self._back_to_m:
                return max(self._back_to_m - self._habits.look_ahead_m, 0.0)
            self._back_to_m = None
        habits = self._habits
        reach_m = habits.look_ahead_m + habits.look_ahead_s * min(speed, self._speed + 0.05)
        return self._seen_straight_m(min(self._progress_m + reach_m, self._path.length_m))

    def _seen_straight_m(self, farthest_m: float) -> float:
        """Arc length of the farthest point, up to `farthest_m`, with nearly no curve before it."""
        places = np.linspace(self._progress_m, farthest_m, AIMS)
        points = self._path.at(places)
        points = points - points[0]
        lengths = np.maximum(np.sqrt((points**2).sum(axis=1)), 1e-12)
        along = points @ (points / lengths[:, None]).T
        onto = np.clip(along, 0.0, lengths)
        squared = (points**2).sum(axis=1)[:, None] - 2.0 * onto * along + onto**2
        beside = np.sqrt(np.maximum(squared, 0.0))
        # Row i, column j: how far point i lies off the straight way to point j beyond it.
        cut = np.triu(beside).max(axis=0)
        fits = np.flatnonzero(cut <= self._habits.cuts_m)
        return max(float(places[fits[-1]]), self._progress_m + self._habits.look_ahead_m)


def _slowing(path: Path) -> tuple[Array, Array]:
    """Places along a path, m, and the share of full speed the two-thirds power law leaves there."""
    count = max(2, int(path.length_m / (0.5 * CURVATURE_REACH_M)) + 1)
    places = np.linspace(0.0, path.length_m, count)
    reach = min(CURVATURE_REACH_M, 0.25 * path.length_m)
    here = path.at(places)
    behind, ahead = here - path.at(places - reach), path.at(places + reach) - here
    lengths = np.linalg.norm(behind, axis=1) * np.linalg.norm(ahead, axis=1)
    cosine = (behind * ahead).sum(axis=1) / np.maximum(lengths, 1e-12)
    turn = np.where(lengths > 0, np.arccos(np.clip(cosine, -1.0, 1.0)), 0.0)
    curvature = turn / reach
    sharp = np.maximum(curvature * FULL_SPEED_RADIUS_M, 1.0)
    return places, sharp ** (-1.0 / 3.0)


def _regrets(habits: Habits, path: Path, rng: np.random.Generator) -> list[float]:
    """Arc lengths at which the mind changes, rising; never so soon that there is no way back."""
    count = int(rng.poisson(habits.changes_of_mind_per_m * path.length_m))
    return sorted(rng.uniform(2.0 * habits.goes_back_m, path.length_m, size=count).tolist())
