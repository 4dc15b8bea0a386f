"""Steps: what is left of a motion after the dead zone (thesis, 3.1.2).

A recognizer sees no time samples but steps: the motion is noted anew only once the hand is at
least the dead zone δ away from where it was noted last.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


class Step(NamedTuple):
    """Step t: the motion from x_t to x_{t+1}."""

    index: int  # type: ignore[assignment]  # tuple.index is of no use here
    """t, counted from 0 without gaps."""
    position: FloatArray
    """x_t, m, shape (3,)."""
    displacement: FloatArray
    """x_{t+1} − x_t, m, shape (3,); at least δ long."""


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
        self._anchor: FloatArray | None = None
        self._newest: FloatArray | None = None
        self._offset = np.zeros(3)
        self._lifted = False

    @property
    def count(self) -> int:
        """Number of steps so far: the index of the next one."""
        return self._count

    def push(self, position: ArrayLike) -> Step | None:
        """Take the hand's position, m, shape (3,); return the step it completes, if any.

        Raises ValueError when it is not of shape (3,) or not finite; nothing changes then.
        """
        seen = np.array(position, dtype=float)
        if seen.shape != (3,) or not np.isfinite(seen).all():
            raise ValueError(f"position is {position!r}, expected three finite numbers")
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

    def lift(self) -> None:
        """Note that the hand is released from the robot (dead-man released, clutch pressed).

        Wherever it comes down again with the next position, the path goes on from where it was
        lifted: motion made meanwhile is taken out.
        """
        self._lifted = True


def steps_of(positions: Iterable[ArrayLike], dead_zone_m: float) -> list[Step]:
    """Return the steps of a whole motion: positions in m, shape (T, 3).

    Raises ValueError as `DeadZone` does.
    """
    zone = DeadZone(dead_zone_m)
    return [step for step in map(zone.push, positions) if step is not None]
