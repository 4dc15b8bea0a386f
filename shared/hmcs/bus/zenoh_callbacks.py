"""What Zenoh calls on its own threads, and what is taken from a sample there."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import zenoh

from hmcs.bus.mailbox import Arrival

T = TypeVar("T")


def on_thread(callback: Callable[[T], None]) -> zenoh.handlers.Callback[T]:
    """Return a Zenoh handler that calls `callback` on the thread that received."""
    return zenoh.handlers.Callback(callback, indirect=False)


def arrival_of(sample: zenoh.Sample, largest_bytes: int) -> Arrival:
    """Return a sample as it arrived; of one that is too large its size alone.

    To copy it would hold up every thread of the process.
    """
    now_ns = time.monotonic_ns()
    payload, attachment = sample.payload, sample.attachment
    size = len(payload)
    sender = attachment.to_bytes() if attachment is not None and len(attachment) <= 64 else b""
    data = payload.to_bytes() if size <= largest_bytes else b""
    return Arrival(str(sample.key_expr), data, now_ns, sender, size_bytes=size)
