"""A device as a source: asked at every tick, mapped, and at rest as soon as it is not believed."""

from __future__ import annotations

import time
from collections.abc import Callable

from hmcs_input_device.devices.mapping import (
    Hand,
    Rules,
    deflected,
    moved,
    problem_with,
    resting,
)
from hmcs_input_device.devices.reading import Device, DeviceReading, UnpluggedError
from hmcs_input_device.press_gate import PressGate
from hmcs_input_device.sources import LIVE, DeviceSample

RATE_HZ = 100.0
REST_WITHIN_S = 0.5
"""So long before the dead-man is pressed at most, the axes have been at rest: pressing it may push
a stick."""


class DeviceSource:
    """The hand that moves a device.

    It rests for as long as the device is gone, silent, sends nonsense, or has an axis that is not
    at rest when the dead-man is pressed, so that the robot stops at once and for a reason that
    `trouble` says. What then ends that is one rule for all sources, see `PressGate`.
    """

    rate_hz = RATE_HZ
    duration_s = LIVE
    reach_m = None

    def __init__(
        self, device: Device, rules: Rules, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Ask `device`; `clock` returns seconds."""
        self._device = device
        self._rules = rules
        self._clock = clock
        self._gate = PressGate(rules.buttons.dead_man)
        self._hand = Hand()
        self._asked_s = clock()
        self._newest: DeviceReading | None = None
        self._newest_s = self._asked_s
        self._rested_s: float | None = None

    @property
    def trouble(self) -> str:
        """Why the device moves nothing, and what to do; empty while all is well."""
        return self._gate.trouble

    def sample(self, elapsed_s: float | None) -> DeviceSample:
        """Return the hand now; at rest, with the dead-man up, before it was asked to play."""
        now_s = self._clock()
        since_s, self._asked_s = now_s - self._asked_s, now_s
        reading, trouble = self._read()
        held = reading is not None and self._rules.buttons.dead_man in reading.buttons
        if reading is not None:
            trouble = self._doubt(now_s, reading, held=held)
        counts = self._gate.passes(now_s, held, trouble)
        if elapsed_s is None and not trouble:
            self._gate.shut("it was held before it was to play")
            counts = False
        if reading is None or trouble:
            self._hand = resting(self._hand)
        else:
            self._hand = moved(self._hand, reading, since_s, self._rules, dead_man=counts)
        hand = self._hand
        return DeviceSample(
            hand.position, hand.velocity, hand.dead_man, clutch=hand.clutch, pedal=hand.pedal
        )

    def close(self) -> None:
        """Let go of the device."""
        self._device.close()

    def _read(self) -> tuple[DeviceReading | None, str]:
        """What the device says, or why it says nothing."""
        try:
            reading = self._device.read()
        except UnpluggedError as error:
            reading, gone = None, str(error)
        else:
            gone = f"{self._device.name} is gone: plug it in again, then {self._anew}"
        if reading is None:
            self._newest = self._rested_s = None
            return None, gone
        return reading, ""

    @property
    def _anew(self) -> str:
        return f"let go of {self._rules.buttons.dead_man} and press it anew"

    def _doubt(self, now_s: float, reading: DeviceReading, *, held: bool) -> str:
        """Why a reading is not believed, and what to do; empty where it is."""
        name = self._device.name
        if problem := problem_with(self._hand.last, reading, self._rules):
            return f"{name} {problem}, so that nothing moves: plug it in anew, or use another"
        if reading != self._newest:
            self._newest, self._newest_s = reading, now_s
        axis, silence = deflected(reading, self._rules), self._rules.silence
        dead_man, silent_s = self._rules.buttons.dead_man, now_s - self._newest_s
        if not axis:
            self._rested_s = now_s
        if self._rested_s is None:
            return (
                f"{name} has not been at rest since it came, see {axis}, so that nothing moves: "
                f"let go of it and of {dead_man}, then press that anew; where an axis never rests, "
                "take it out of device.axes or widen device.dead_band"
            )
        if held and silent_s > (silence.deflected_s if axis else silence.resting_s):
            return f"{name} is silent while {dead_man} is held: {self._anew}"
        if held and not self._gate.open and now_s - self._rested_s > REST_WITHIN_S:
            return (
                f"{name} was not at rest when {dead_man} was pressed, see {axis}, so that nothing "
                f"moves: let go of it and of {dead_man}, then press that anew; where it drifts, "
                "widen device.dead_band"
            )
        return ""
