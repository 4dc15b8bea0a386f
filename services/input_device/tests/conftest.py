"""A router, and an input device in this thread with somebody who listens."""

from __future__ import annotations

import logging
import socket
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import Message, Motion, Step
from hmcs.bus.router import open_router
from hmcs.bus.session import Bus, BusSettings, Received
from hmcs.motion.demonstrations import Demonstration, write_csv
from hmcs_input_device import guarded, press_gate
from hmcs_input_device import service as service_module
from hmcs_input_device.service import InputDevice
from hmcs_input_device.settings import InputDeviceSettings
from support.hand_device import Hand

DEADLINE_S = 60.0
LOG = logging.getLogger("test")


@pytest.fixture(scope="session")
def router() -> Iterator[str]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with open_router(endpoint):
        yield endpoint


@pytest.fixture
def line() -> Demonstration:
    """0.2 m along y in one second, 100 samples a second, evenly."""
    time_s = np.arange(101) / 100
    positions = np.stack([np.full(101, 0.5), 0.2 * time_s, np.full(101, 0.4)], axis=1)
    return Demonstration("line.csv", time_s, positions, (None,) * 101)


@pytest.fixture
def line_file(tmp_path: Path, line: Demonstration) -> Path:
    file = tmp_path / "line.csv"
    write_csv(file, line)
    return file


class Desk:
    """An input device and somebody who listens to it, both in this thread."""

    def __init__(self, router: str, stack: ExitStack, **settings: Any) -> None:
        self.router, self.stack = router, stack
        self.buses: list[Bus] = []
        self.listener = self.open_bus("listener")
        self.motions: list[Received[Motion]] = []
        self.steps: list[Received[Step]] = []
        self.listener.subscribe(Motion, self.listener.keys.motion, self.motions.append)
        self.listener.subscribe(Step, self.listener.keys.step, self.steps.append)
        self.bus = self.open_bus("input_device")
        self.service = InputDevice(InputDeviceSettings(router=router, **settings), self.bus, LOG)
        self.service.start()
        self.until(lambda: self.motions, "the first sample")

    def open_bus(self, service: str) -> Bus:
        """Open one more place on the bus, pumped with the others from now on."""
        settings = BusSettings(router=self.router, connect_timeout_s=DEADLINE_S)
        bus = self.stack.enter_context(Bus.open(settings, service, "x", log=LOG))
        self.buses.append(bus)
        return bus

    def until(self, condition: Callable[[], object], what: str) -> None:
        """Pump all until the condition holds; fail naming `what` after the deadline."""
        deadline_s = time.monotonic() + DEADLINE_S
        while not condition():
            assert time.monotonic() < deadline_s, f"waited in vain for {what}"
            self.bus.pump(0.001)
            for bus in self.buses:
                bus.pump(0)

    def until_finished(self) -> None:
        """Pump until it has played to the end and everything has arrived."""
        self.until(lambda: self.service.facts()["playing"] == "finished", "the end")
        count = len(self.motions)
        self.until(lambda: len(self.motions) > count + 3, "samples after the end")

    def ask(self, verb: str, question: Message, answer_type: type[Message]) -> Any:
        """Ask the service over the bus; return its answer, or the refusal as an exception."""
        key = self.bus.keys.rpc("input_device", "x", verb)
        with ThreadPoolExecutor(1) as pool:
            asked = pool.submit(self.listener.ask, key, question, answer_type, DEADLINE_S)
            deadline_s = time.monotonic() + DEADLINE_S
            while not asked.done() and time.monotonic() < deadline_s:
                self.bus.pump(0.001)
        return asked.exception() or asked.result()[0].body


@pytest.fixture
def make_desk(router: str) -> Iterator[Callable[..., Desk]]:
    """Bring up an input device with these settings."""
    with ExitStack() as stack:
        yield lambda **settings: Desk(router, stack, **settings)


@pytest.fixture
def play(make_desk: Callable[..., Desk], line_file: Path) -> Callable[..., Desk]:
    """Bring up an input device that plays the line."""
    settings = {
        "source": "recorded",
        "demonstration": line_file,
        "lead_in_s": 0.2,
        "rate_hz": 100.0,
        "dead_zone_m": 0.02,
    }
    return lambda **changes: make_desk(**(settings | changes))


@pytest.fixture
def hand(monkeypatch: pytest.MonkeyPatch) -> Hand:
    """A device that a hand moves, under the name `hand`; nothing counts as a hang."""
    device = Hand()
    monkeypatch.setattr(service_module, "BUILT_IN", {"hand": lambda *_: device})
    # A busy machine may hold this test up; what becomes of a hang is tested without a clock.
    monkeypatch.setattr(press_gate, "HANG_S", 60.0)
    monkeypatch.setattr(guarded, "FROZEN_S", 60.0)
    return device
