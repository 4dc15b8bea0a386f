"""Ctrl-C and its like: they end a command by an exception, and nothing half-way."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

_INTERRUPTS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

T = TypeVar("T")


@contextmanager
def interruptible() -> Iterator[None]:
    """Turn SIGTERM and SIGHUP into KeyboardInterrupt, as Ctrl-C does; a second one changes nothing.

    Stopping the stack is not interrupted half-way: its end is bounded by the graces.
    """

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        for each in _INTERRUPTS:
            signal.signal(each, signal.SIG_IGN)
        raise KeyboardInterrupt

    before = {number: signal.signal(number, interrupt) for number in _INTERRUPTS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def uninterrupted(act: Callable[[], T]) -> tuple[T, bool]:
    """Return what `act` returns, and whether an interrupt came meanwhile: it is the caller's then.

    Where this is not the main thread none comes here.
    """
    if threading.current_thread() is not threading.main_thread():
        return act(), False
    came: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _frame: came.append(number))
        for number in _INTERRUPTS
    }
    try:
        result = act()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    return result, bool(came)
