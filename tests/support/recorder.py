"""A recorder on the bus, with a hand in the same thread, and what goes wrong around it."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np

from hmcs.bus.messages import Motion
from hmcs.bus.session import Bus
from hmcs.recordings.reading import RecordingContent, read
from hmcs_recorder.service import Recorder
from hmcs_recorder.settings import RecorderSettings
from support.hand import Hand
from support.stack import Stack

LOG = logging.getLogger("test")


class Bench:
    """A recorder, a hand and somebody who asks, all in this thread."""

    def __init__(self, stack: Stack, folder: Path, **settings: Any) -> None:
        self.stack, self.folder = stack, folder
        self.hand = Hand(stack.open_bus("input_device", "hand"))
        self.bus = stack.open_bus("recorder", "here")
        reported = RecorderSettings(folder=folder, flush_s=0.05, free_mb=0.0, **settings)
        self.service = Recorder(reported, self.bus, LOG)
        self.service.start()
        stack.until(lambda: self.hand._motions.matching)

    def sample(self, count: int) -> None:
        """Send so many samples, and wait until the recorder has seen them."""
        wanted = self.bus.counters.received[Motion.SCHEMA] + count
        for k in range(count):
            self.hand.sample([0.001 * k, 0.0, 0.0], np.zeros(3))
        self.stack.until(lambda: self.bus.counters.received[Motion.SCHEMA] >= wanted)

    def sample_unrecorded(self) -> None:
        """Send a sample that nobody is to write down."""
        self.hand.sample(np.zeros(3), np.zeros(3))
        for _ in range(5):
            self.stack.until(lambda: self.bus.pump(0.02) >= 0)

    def content(self) -> RecordingContent:
        (file,) = self.folder.glob("*.mcap")
        return read(file)


@contextmanager
def pumped(bus: Bus) -> Iterator[None]:
    """A bus that answers on a thread of its own."""
    over = Event()

    def pump() -> None:
        while not over.is_set():
            bus.pump(0.01)

    with ThreadPoolExecutor(1) as aside:
        answering = aside.submit(pump)
        try:
            yield
        finally:
            over.set()
        answering.result()


# --- names and folders ----------------------------------------------------------------------------


def denied(*_: object, **__: object) -> None:
    raise PermissionError(13, "Permission denied")
