"""What mutual TLS costs: one hop over a router, with certificates and without, in turns."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from rich.progress import Progress

from bench.figures import Figure, percentile_ms
from hmcs.bus.messages import Motion
from hmcs.bus.session import Received
from hmcs_secure.closed_cell import ClosedCell
from support.closed_cells import new_closed_cell
from support.stack import CELL, Stack

RATIO = 1.2
RATE_HZ = 100.0
_TURNS = 4


def measure(span_s: float, progress: Progress) -> list[Figure]:
    """Measure both for so long, in turns of a few seconds each."""
    turns = progress.add_task("one hop", total=2 * _TURNS)
    plain_ns: list[int] = []
    closed_ns: list[int] = []
    with tempfile.TemporaryDirectory(prefix="hmcs-hop-") as name:
        cell = new_closed_cell(Path(name), CELL)
        for turn in range(_TURNS):
            for closed, into in ((None, plain_ns), (cell, closed_ns)):
                folder = Path(name) / f"{turn}-{closed is not None}"
                into += _hops(folder, span_s / _TURNS, closed)
                progress.advance(turns)
    plain_ms, closed_ms = percentile_ms(plain_ns, 50), percentile_ms(closed_ns, 50)
    return [
        Figure("one hop, p50", plain_ms, "ms"),
        Figure("one hop under mutual TLS, p50", closed_ms, "ms"),
        Figure("the one / the other", closed_ms / plain_ms, at_most=RATIO),
    ]


def _hops(folder: Path, span_s: float, closed: ClosedCell | None) -> list[int]:
    folder.mkdir()
    with Stack(folder, closed) as stack:
        heard: list[Received[Motion]] = []
        receiver = stack.open_bus("operator", "receiver")
        sender = stack.open_bus("input_device", "sender")
        receiver.subscribe(Motion, receiver.keys.motion, heard.append)
        motions = sender.publisher(Motion, sender.keys.motion)
        sent: dict[int, int] = {}

        def say() -> None:
            at_ns = time.monotonic_ns()
            motion = Motion(position=np.zeros(3), velocity=np.zeros(3), dead_man=False)
            sent[motions.put(motion).seq] = at_ns

        timer = sender.every(1.0 / RATE_HZ, say)
        stack.until(lambda: heard)
        stack.elapse(span_s)
        timer.cancel()
        return [r.received_ns - sent[r.envelope.seq] for r in heard]
