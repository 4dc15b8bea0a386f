"""Devices of an operator's hand that say what a test tells them to."""

from __future__ import annotations

import sys
from itertools import count
from types import ModuleType
from typing import Any

import pytest

from hmcs.task import load_task
from hmcs_input_device.devices.device_source import DeviceSource
from hmcs_input_device.devices.mapping import AxisMap, Buttons, Usual, rules_of
from hmcs_input_device.devices.reading import DeviceReading, UnpluggedError
from hmcs_input_device.settings import DeviceSettings
from hmcs_input_device.sources import DeviceSample

TASK = load_task("human-shapes")
PERIOD_S = 0.01
STICK = Usual("rate", AxisMap("x", "y", "z"), Buttons("hold", "slip", "mark"))
POINTER = Usual("position", AxisMap("none", "-x", "y"), STICK.buttons, has=("x", "y"))


class FakeDevice:
    """A device whose samples a test sets."""

    name = "stick"

    def __init__(self) -> None:
        self.says: DeviceReading | UnpluggedError | None = DeviceReading((0.0,) * 6)
        self.closed = False

    def read(self) -> DeviceReading | None:
        if isinstance(self.says, UnpluggedError):
            raise self.says
        return self.says

    def close(self) -> None:
        self.closed = True


class Desk:
    """A device asked a hundred times a second."""

    def __init__(
        self, usual: Usual = STICK, comes_at: tuple[float, ...] = (), **settings: Any
    ) -> None:
        self.device, self.now_s = FakeDevice(), 5.0
        rules = rules_of(DeviceSettings(**settings), usual)
        self.source = DeviceSource(self.device, rules, lambda: self.now_s)
        self.tell(*comes_at)

    def tell(
        self,
        *axes: float,
        press: str = "",
        pointer: tuple[float, float] | None = (0.0, 0.0),
        times: int = 1,
    ) -> DeviceSample:
        """Let it say this so many times; return the last sample."""
        filled = (*axes, *(0.0,) * (6 - len(axes)))
        self.device.says = DeviceReading(filled, frozenset(press.split()), pointer)
        return self.ask(times)

    def ask(self, times: int = 1) -> DeviceSample:
        for _ in range(times):
            self.now_s += PERIOD_S
            sample = self.source.sample(self.now_s)
        return sample

    def hold(self) -> None:
        """Let go of everything, then press the dead-man."""
        self.tell()
        self.tell(press="hold")


def fake_library(monkeypatch: pytest.MonkeyPatch, name: str, **contents: Any) -> ModuleType:
    """Put a library of these contents in the place of one that is not installed."""
    module = ModuleType(name)
    module.__dict__.update(contents)
    monkeypatch.setitem(sys.modules, name, module)
    return module


def on_a_clock(source: Any) -> Any:
    """Let the time of a source go on by a hundredth of a second with every sample."""
    ticks = count()
    source._clock = lambda: PERIOD_S * next(ticks)
    return source
