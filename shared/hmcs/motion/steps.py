"""Steps: what is left of a motion after the dead zone (thesis, 3.1.2).

A recognizer sees no time samples but steps: the motion is noted anew only once the hand is at
least the dead zone δ away from where it was noted last. What the hand felt and signaled on the
way goes along with the step.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import repeat
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.quaternions import nearer, unit_quaternion


class Step(NamedTuple):
    """Step t: the motion from x_t to x_{t+1}."""

    index: int  # type: ignore[assignment]  # tuple.index is of no use here
    """t, counted from 0 without gaps."""
    position: Array
    """x_t, m, shape (3,)."""
    displacement: Array
    """x_{t+1} − x_t, m, shape (3,); at least δ long."""
    orientation: Array | None = None
    """Of the hand where the step ends, unit quaternion x y z w, shape (4,), with the sign nearer to
    that of the step before; None where the device has none."""
    wrench: Array | None = None
    """The operator's force, N, and torque, N·m, shape (6,): the mean over the samples of the step,
    the one that ends it included; None where the device has none."""
    mark: bool = False
    """Whether the pedal went down in this step, its first sample included and its last one not: the
    operator says that a new part of the task begins with it."""


class DeadZone:
    """Turns positions, one at a time, into steps of the engaged hand.

    The position of step t + 1 is the position of step t plus its displacement, to the last bit.
    """

    def __init__(self, radius_m: float) -> None:
        """Set the dead zone δ, m.

        Raises ValueError unless it is a positive, finite number.
        """
        if not (np.isfinite(radius_m) and radius_m > 0):
            raise ValueError(f"radius_m is {radius_m}, expected a positive number of meters")
        self._radius_m = float(radius_m)
        self._count = 0
        self._anchor: Array | None = None
        self._newest: Array | None = None
        self._offset = np.zeros(3)
        self._lifted = False
        self._senses = _Senses()

    @property
    def count(self) -> int:
        """Number of steps so far: the index of the next one."""
        return self._count

    def push(
        self,
        position: ArrayLike,
        *,
        orientation: ArrayLike | None = None,
        wrench: ArrayLike | None = None,
        pedal: bool = False,
    ) -> Step | None:
        """Take a sample of the engaged hand; return the step it completes, if any.

        A sample is the position, m, shape (3,); the orientation, unit quaternion x y z w, shape
        (4,); force and torque, N and N·m, shape (6,); and whether the pedal is down.
        Raises ValueError when one is of another shape, not finite, or the quaternion is not of unit
        length within 1e-3; nothing changes then.
        """
        seen = _finite("position", position, 3)
        turned = None if orientation is None else unit_quaternion(orientation)
        felt = None if wrench is None else _finite("wrench", wrench, 6)
        self._senses.feel(felt)
        signaled = self._senses.goes_down(pedal)
        step = self._moved(seen)
        # The sample that ends a step is where the next one begins: its signal is for that one.
        completed = None if step is None else self._senses.along(step, turned)
        self._senses.mark |= signaled
        return completed

    def lift(self, *, pedal: bool = False) -> None:
        """Note that the hand is released from the robot (dead-man released, clutch pressed).

        Wherever it comes down again with the next position, the path goes on from where it was
        lifted: motion made meanwhile is taken out. A pedal that goes down meanwhile marks the next
        step to be completed.
        """
        self._lifted = True
        self._senses.mark |= self._senses.goes_down(pedal)

    def _moved(self, seen: Array) -> Step | None:
        if self._anchor is None or self._newest is None:
            self._anchor = self._newest = seen
            self._lifted = False
            return None
        if self._lifted:
            self._offset = seen - self._newest
            self._lifted = False
        self._newest = seen - self._offset
        displacement = self._newest - self._anchor
        if np.linalg.norm(displacement) < self._radius_m:
            return None
        step = Step(self._count, self._anchor, displacement)
        self._count += 1
        self._anchor = step.position + step.displacement
        return step


def _finite(name: str, value: ArrayLike, count: int) -> Array:
    numbers = np.array(value, dtype=float)
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise ValueError(f"{name} is {value!r}, expected {count} finite numbers")
    return numbers


class _Senses:
    """What is felt and signaled while a step is under way."""

    def __init__(self) -> None:
        self.mark = False
        self._pedal = False
        self._orientation: Array | None = None
        self._wrench_sum = np.zeros(6)
        self._wrench_count = 0

    def feel(self, wrench: Array | None) -> None:
        if wrench is not None:
            self._wrench_sum += wrench
            self._wrench_count += 1

    def goes_down(self, pedal: bool) -> bool:
        before, self._pedal = self._pedal, pedal
        return pedal and not before

    def along(self, step: Step, orientation: Array | None) -> Step:
        """Return the step with all that came along with it, and begin anew."""
        if orientation is not None:
            if self._orientation is not None:
                orientation = nearer(orientation, self._orientation)
            self._orientation = orientation
        wrench = self._wrench_sum / self._wrench_count if self._wrench_count else None
        mark, self.mark = self.mark, False
        self._wrench_sum, self._wrench_count = np.zeros(6), 0
        return step._replace(orientation=orientation, wrench=wrench, mark=mark)


def steps_of(
    positions: Iterable[ArrayLike],
    dead_zone_m: float,
    *,
    orientations: Iterable[ArrayLike] | None = None,
    wrenches: Iterable[ArrayLike] | None = None,
    pedals: Iterable[bool] | None = None,
) -> list[Step]:
    """Return the steps of a whole motion: positions in m, shape (T, 3).

    Beside them, where there are such, orientations (T, 4), wrenches (T, 6) and whether the pedal is
    down (T,), as `DeadZone.push` takes them.
    Raises ValueError as `DeadZone` does, and when there are not as many of each.
    """
    zone = DeadZone(dead_zone_m)
    samples = list(positions)
    senses = (orientations, wrenches, pedals)
    columns = [repeat(None, len(samples)) if sense is None else sense for sense in senses]
    made = (
        zone.push(position, orientation=orientation, wrench=wrench, pedal=bool(pedal))
        for position, orientation, wrench, pedal in zip(samples, *columns, strict=True)
    )
    return [step for step in made if step is not None]


def steps_of_demonstration(
    demonstration: Demonstration, dead_zone_m: float, *, mark_switches: bool = False
) -> list[Step]:
    """Return the steps of a demonstration, with the senses it has.

    With `mark_switches` the pedal goes down wherever a label begins.
    Raises ValueError as `steps_of` does.
    """
    return steps_of(
        demonstration.positions,
        dead_zone_m,
        orientations=demonstration.orientations,
        wrenches=demonstration.wrenches,
        pedals=demonstration.switches if mark_switches else None,
    )


class SampledStep(NamedTuple):
    """A step, and the samples it was made in."""

    step: Step
    begin: int
    """Index of the sample at which it begins."""
    end: int
    """Index of the sample at which it ends, where the next one begins."""


def sampled_steps(demonstration: Demonstration, dead_zone_m: float) -> Iterator[SampledStep]:
    """Yield the steps of a demonstration, with the senses it has and the samples they are made in.

    Raises ValueError as `steps_of` does.
    """
    zone, begin = DeadZone(dead_zone_m), 0
    for end, position in enumerate(demonstration.positions):
        orientations, wrenches = demonstration.orientations, demonstration.wrenches
        step = zone.push(
            position,
            orientation=None if orientations is None else orientations[end],
            wrench=None if wrenches is None else wrenches[end],
        )
        if step is not None:
            yield SampledStep(step, begin, end)
            begin = end
