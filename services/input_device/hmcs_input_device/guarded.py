"""The check that every source goes through, built in or of another distribution."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
from pydantic import ValidationError

from hmcs.bus.messages import Motion
from hmcs.errors import first_problem
from hmcs_input_device.press_gate import SILENT_S, PressGate
from hmcs_input_device.sources import (
    FARTHEST_M,
    FASTEST_M_S,
    DeviceSample,
    Source,
    Troubled,
    at_rest,
    plays,
    released,
)

FROZEN_S = 0.5
"""A device that repeats the very same motion or force for so long has stopped reporting."""
FASTEST_RAD_S = 50.0
"""No hand turns faster."""
JUMP_M = 0.05
"""Added to the way of the fastest hand: a position farther from the one before it is a jump."""
LARGEST_WRENCH = 1e4
"""No hand pushes harder, N and N·m."""
STILL_M_S, STILL_N = 1e-3, 0.5
"""A hand slower and weaker than this rests, and may tell the same for as long as it likes."""
LETTERS = 200
"""How much of the text of an exception is shown."""


class Guarded:
    """A source whose samples are checked, and whose dead-man counts by the rule of `PressGate`.

    Where the source returns nothing, raises, or returns what no hand does, the hand rests where it
    was last. Of a source that plays only malformed samples are refused: nobody presses its switch.
    """

    def __init__(self, source: Source, name: str) -> None:
        self._source = source
        self._name = name
        self._plays = plays(source)
        self._gate = PressGate("the dead-man's switch", minds_hangs=not self._plays)
        self._hand: DeviceSample | None = None
        self._last_sample: DeviceSample | None = None
        self._last_sample_s = self._same_since_s = -float("inf")
        self._fault = ""
        self.refusal = ""
        """Why the last sample was refused as malformed or impossible; empty where it was not."""

    @property
    def trouble(self) -> str:
        """Why nothing moves, and what to do; empty while all is well."""
        return self._reported() or self._fault or self._gate.trouble

    def sample(self, now_s: float, elapsed_s: float | None) -> DeviceSample | None:
        """Return the hand at `now_s`; None before the source has said anything of use.

        `elapsed_s` as in `Source.sample`.
        """
        # Whatever a device of another distribution raises, the hand rests and the service goes on.
        self._fault = self.refusal = ""
        try:
            checked = self._checked(now_s, self._source.sample(elapsed_s))
        except _SilentError as error:
            self._fault = f"{self._name}: {error}"
        except _NoSampleError as error:
            self._fault = self.refusal = f"{self._name}: {error}"
        except Exception as error:
            failed = f"{self._name}: failed with {type(error).__name__} ({str(error)[:LETTERS]})"
            self._fault = self.refusal = f"{failed}: check the device"
        if self._fault:
            self._gate.passes(now_s, pressed=False, trouble=self._fault)
            self._hand = None if self._hand is None else at_rest(self._hand)
            return self._hand
        if elapsed_s is None:
            self._gate.shut("it was held before it was to play")
        elif self._gate.passes(now_s, checked.dead_man, self._reported()):
            self._hand = checked
            return checked
        self._hand = released(checked)
        return self._hand

    def _reported(self) -> str:
        return self._source.trouble if isinstance(self._source, Troubled) else ""

    def _checked(self, now_s: float, sample: DeviceSample | None) -> DeviceSample:
        """Return a copy of a sample; raises _NoSampleError or _SilentError for an unusable one."""
        if sample is None:
            raise _SilentError("gives no samples: check the device")
        try:
            motion = Motion(**sample._asdict())
        except ValidationError as error:
            where, why = first_problem(error)
            raise _NoSampleError(f"gives malformed samples: {where}: {why}") from None
        if not np.abs(motion.position).max() <= FARTHEST_M:
            raise _NoSampleError(f"its hand is farther than {FARTHEST_M:g} m: check its scale")
        # A device may reuse its arrays.
        sample = deepcopy(sample)
        if not self._plays:
            self._doubt(now_s, sample)
        return sample

    def _doubt(self, now_s: float, sample: DeviceSample) -> None:
        """Raise where no hand does this, or where the sample is old."""
        before, before_s = self._last_sample, self._last_sample_s
        self._last_sample, self._last_sample_s = sample, now_s
        if sample.age_s is not None and not 0.0 <= sample.age_s <= SILENT_S:
            raise _SilentError("is silent: check the device")
        for what, vector, largest, unit in (
            ("moves", sample.velocity, FASTEST_M_S, "m/s"),
            ("turns", sample.angular_velocity, FASTEST_RAD_S, "rad/s"),
            ("pushes", sample.wrench, LARGEST_WRENCH, "N"),
        ):
            if vector is not None and np.linalg.norm(vector) > largest:
                raise _NoSampleError(f"{what} with more than {largest:g} {unit}: check the device")
        if before is None or _differ(before, sample) or not (sample.dead_man and _works(sample)):
            self._same_since_s = now_s
        if now_s - self._same_since_s > FROZEN_S:
            raise _SilentError("repeats the very same motion: check the device")
        if before is None or not (self._gate.open and sample.dead_man):
            return
        way_m = float(np.linalg.norm(np.subtract(sample.position, before.position)))
        held = not (before.clutch or sample.clutch)
        if held and way_m > FASTEST_M_S * (now_s - before_s) + JUMP_M:
            raise _NoSampleError(f"jumped by {way_m:.3g} m: check the device")


class _NoSampleError(Exception):
    """A sample is malformed, or no hand does what it says."""


class _SilentError(Exception):
    """A source has nothing new to tell."""


def _works(sample: DeviceSample) -> bool:
    pushes = sample.wrench is not None and np.linalg.norm(sample.wrench) > STILL_N
    return bool(pushes or np.linalg.norm(sample.velocity) > STILL_M_S)


def _differ(one: DeviceSample, other: DeviceSample) -> bool:
    pairs: tuple[tuple[Any, Any], ...] = (
        (one.position, other.position),
        (one.velocity, other.velocity),
        (one.orientation, other.orientation),
        (one.wrench, other.wrench),
    )
    return any(not np.array_equal(before, now) for before, now in pairs)
