"""Draws on a thread of its own, so that nothing a browser does holds up the bus."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, Full, Queue
from typing import Generic, TypeVar

from hmcs.bus.logs import RateLimitedLog
from hmcs.shown import plain
from hmcs_console.serving.pace import next_rate_hz

T = TypeVar("T")


class Painter(Generic[T]):
    """Draws the newest picture, as often as it can and no oftener than wanted."""

    def __init__(self, draw: Callable[[T], None], wanted_hz: float, log: logging.Logger) -> None:
        self._draw = draw
        self._wanted_hz = wanted_hz
        self._limited = RateLimitedLog(log)
        self._slot: Queue[T | None] = Queue(maxsize=1)
        self._next_s = 0.0
        self.rate_hz = wanted_hz
        """How often it draws now."""
        self.failure = ""
        """What went wrong in the last drawing; empty where nothing did."""
        self._thread = threading.Thread(target=self._run, name="painter", daemon=True)
        self._thread.start()

    def due(self, now_s: float) -> bool:
        """Whether it is time for another picture, and the last one is done."""
        return now_s >= self._next_s and self._slot.empty()

    def show(self, now_s: float, picture: T) -> None:
        """Have a picture drawn; left out where the one before still waits."""
        self._next_s = now_s + 1 / self.rate_hz
        with suppress(Full):
            self._slot.put_nowait(picture)

    def close(self) -> None:
        """End, after what is being drawn."""
        with suppress(Empty):
            self._slot.get_nowait()
        self._slot.put(None)
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while (picture := self._slot.get()) is not None:
            began_s = time.monotonic()
            try:
                self._draw(picture)
                self.failure = ""
            except Exception as error:
                self.failure = plain(f"{type(error).__name__}: {error}")
                self._limited.warning("drawing", "a drawing failed: going on", exc_info=True)
            took_s = time.monotonic() - began_s
            self.rate_hz = next_rate_hz(self.rate_hz, took_s, self._wanted_hz)
