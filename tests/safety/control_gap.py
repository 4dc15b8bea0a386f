"""Messages of up to 64 MB on every key, then 10 000 bad ones a second: does control go on?

A control tick that comes later than two of its periods is counted by the robot itself.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import msgpack
import numpy as np
import zenoh
from rich.progress import Progress

from bench.figures import Figure
from hmcs.bus.config import client_config
from hmcs.bus.keys import Keys
from support.stack import Stack
from support.stops import FastLoop

LARGEST_BYTES = 64_000_000
SIZES = (1_000, 1_000_000, 12_000_000, LARGEST_BYTES)
BAD_A_SECOND = 10_000
_WATCHED_S = 1.5
"""After each message; a large one takes its time on the way."""


def measure(flood_s: float, progress: Progress) -> list[Figure]:
    """Send each, and flood for so long; every figure is of the same run."""
    with (
        tempfile.TemporaryDirectory(prefix="hmcs-gap-") as name,
        Stack(Path(name) / "logs") as stack,
    ):
        loop = FastLoop(stack, Path(name), np.random.default_rng(0))
        loop.until_moving()
        with zenoh.open(client_config(stack.settings("stranger"))) as stranger:
            quiet = _during(loop, lambda: stack.elapse(flood_s))
            keys = tuple(_keys(loop.watcher.bus.keys))
            done = progress.add_task("large messages", total=len(keys) * len(SIZES))
            single = []
            for size in SIZES:
                for key, kind in keys:
                    data = bytes(size) if kind == "zeros" else _nested(size)
                    single.append(_during(loop, lambda k=key, d=data: _one(stack, stranger, k, d)))
                    progress.advance(done)
            flooded = _during(loop, lambda: _flood(stack, stranger, keys, flood_s))
    stands = max(seen.longest_s for seen in single)
    return [
        Figure("control ticks later than two periods, quiet", quiet.late),
        Figure(f"messages of up to {LARGEST_BYTES // 10**6} MB", len(single)),
        Figure("the same by any one of them, most", max(s.late for s in single), at_most=0),
        Figure("robot states apart by any one of them, most", 1e3 * stands, "ms"),
        Figure("the same, quiet", 1e3 * quiet.longest_s, "ms"),
        Figure(f"the same by {BAD_A_SECOND} bad ones a second", flooded.late, at_most=0),
    ]


class _Seen:
    """What the robot did in a stretch of time."""

    def __init__(self, late: int, longest_s: float) -> None:
        self.late, self.longest_s = late, longest_s


def _during(loop: FastLoop, act: Callable[[], object]) -> _Seen:
    before = len(loop.watcher.robot) - 1
    act()
    states = loop.watcher.robot[before:]
    received_ns = [state.received_ns for state in states]
    late = states[-1].body.late_ticks - states[0].body.late_ticks
    return _Seen(late, float(np.diff(received_ns).max()) * 1e-9)


def _keys(keys: Keys) -> Iterator[tuple[str, str]]:
    for key in (keys.command, keys.motion, keys.robot_state, keys.belief("m", "x"), keys.pairing):
        yield key, "zeros"
        yield key, "nested"


def _one(stack: Stack, stranger: zenoh.Session, key: str, data: bytes) -> None:
    stranger.put(key, data)
    stack.elapse(_WATCHED_S)


def _flood(
    stack: Stack, stranger: zenoh.Session, keys: tuple[tuple[str, str], ...], flood_s: float
) -> None:
    crowd = _nested(2_000)
    begun_s, sent = time.monotonic(), 0
    while (passed_s := time.monotonic() - begun_s) < flood_s:
        while sent < passed_s * BAD_A_SECOND:
            stranger.put(keys[sent % len(keys)][0], crowd)
            sent += 1
        stack.pump()


def _nested(size: int) -> bytes:
    """A map whose one field is as many small arrays as fit into so many bytes."""
    packed: bytes = msgpack.packb({"schema": "command/1", "twist": [[0.0]] * (size // 10)})
    return packed
