"""A device as a source: asked at every tick, mapped, and at rest as soon as it is gone."""

from __future__ import annotations

import time
from collections.abc import Callable

from hmcs_input_device.devices.mapping import Hand, Rules, moved, unplugged
from hmcs_input_device.devices.reading import Device, DeviceReading, UnpluggedError
from hmcs_input_device.sources import LIVE, DeviceSample

RATE_HZ = 100.0


class DeviceSource:
    """The hand that moves a device.

    It says that it rests for as long as the device is gone, so that the robot stops at once and for
    a reason that `trouble` tells. Nothing moves until the dead-man was seen released: when the
    device comes, when it comes back, and when it is told to play.
    """

    rate_hz = RATE_HZ
    duration_s = LIVE
    reach_m = None

    def __init__(
        self, device: Device, rules: Rules, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Ask `device`; `clock` tells seconds."""
        self._device = device
        self._rules = rules
        self._clock = clock
        self._hand = Hand()
        self._asked_s = clock()
        self._trouble = ""

    @property
    def trouble(self) -> str:
        """Why the device moves nothing, and what to do; empty while all is well."""
        return self._trouble

    def sample(self, elapsed_s: float | None) -> DeviceSample:
        """Return the hand now; at rest, with the dead-man up, before it is told to play."""
        now_s = self._clock()
        since_s, self._asked_s = now_s - self._asked_s, now_s
        reading = self._read()
        if reading is None:
            self._hand = unplugged(self._hand)
        else:
            self._hand = moved(self._hand, reading, since_s, self._rules)
            self._trouble = self._trouble_with(reading)
        if elapsed_s is None:
            self._hand = unplugged(self._hand)
        hand = self._hand
        return DeviceSample(
            hand.position, hand.velocity, hand.dead_man, clutch=hand.clutch, pedal=hand.pedal
        )

    def close(self) -> None:
        """Let go of the device."""
        self._device.close()

    def _read(self) -> DeviceReading | None:
        try:
            reading = self._device.read()
        except UnpluggedError as error:
            self._trouble = str(error)
            return None
        if reading is None:
            self._trouble = (
                f"{self._device.name} is gone: plug it in again, then let go of "
                f"{self._rules.buttons.dead_man} and press it anew"
            )
        return reading

    def _trouble_with(self, reading: DeviceReading) -> str:
        if self._hand.problem:
            return (
                f"{self._device.name} {self._hand.problem}, so that nothing moves: plug it in "
                "anew, or use another"
            )
        if not self._hand.released:
            return (
                f"{self._device.name}: {self._rules.buttons.dead_man} is held since before it was "
                "there, so that nothing moves: let go of it and press it anew"
            )
        return ""
