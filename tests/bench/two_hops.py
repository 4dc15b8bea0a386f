"""Input → fixture → robot: how long the two hops of the fast loop take, beside raw sockets.

Measured from the capture of a sample to the arrival of its command where the robot would be.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from bench import sockets
from bench.chains import Stages
from bench.figures import Figure, percentile_ms, tell
from hmcs.bus.messages import Command
from hmcs.bus.session import Received
from support.stack import Stack
from support.stops import circles

RATE_HZ = 100.0
RATIO = 3.0
"""Times the median over raw sockets that the stack may take."""


def measure(span_s: float) -> list[Figure]:
    """Measure both, half of the raw sockets before and half after the stack."""
    with tempfile.TemporaryDirectory() as folder:
        path = circles(Path(folder))
        raw = over_sockets("fixture", span_s / 2, path)
        bare = over_sockets("pipe", span_s / 4, path)
        bus = over_the_bus(span_s, path)
        bare += over_sockets("pipe", span_s / 4, path)
        raw += over_sockets("fixture", span_s / 2, path)
    ratio = percentile_ms(bus, 50) / percentile_ms(raw, 50)
    return [
        Figure("bytes handed on over raw sockets, p50", percentile_ms(bare, 50), "ms"),
        Figure("the same stages over raw sockets, p50", percentile_ms(raw, 50), "ms"),
        Figure("the same stages over raw sockets, p99", percentile_ms(raw, 99), "ms"),
        Figure("input to robot, two hops, p50", percentile_ms(bus, 50), "ms"),
        Figure("input to robot, two hops, p99", percentile_ms(bus, 99), "ms"),
        Figure("input to robot p50 / the same over raw sockets", ratio, at_most=RATIO),
    ]


def over_the_bus(span_s: float, path: Path) -> list[int]:
    """Return the times over the stack, ns."""
    with Stack(path.parent / "logs") as stack:
        commands: list[Received[Command]] = []
        bus = stack.open_bus("robot", "sink")
        stack.watch(bus)
        bus.subscribe(Command, bus.keys.command, commands.append)
        stack.until_ready(
            stack.start("fixture_controller", "f"),
            stack.start(
                "input_device",
                "i",
                *("--source", "recorded", "--demonstration", path),
                *("--rate-hz", RATE_HZ, "--repeat", 0, "--lead-in-s", 0.4),
            ),
        )
        stack.until(lambda: any(r.body.engaged for r in commands))
        commands.clear()
        end_s = time.monotonic() + span_s
        while time.monotonic() < end_s:
            bus.pump(0.1)
        return [
            r.received_ns - r.envelope.origin.captured_ns for r in commands if r.envelope.origin
        ]


def over_sockets(middle: str, span_s: float, path: Path) -> list[int]:
    """Return the times over raw sockets, with that stage in the middle, ns."""
    server, port = sockets.listen()
    with Stages() as stages, server:
        entry = stages.listening(middle, port)
        with sockets.accept(server) as before:
            count = round(span_s * RATE_HZ)
            stages.start("operator", entry, "--file", path, "--rate-hz", RATE_HZ, "--count", count)
            return [time.monotonic_ns() - frame.caused_ns for frame in sockets.frames(before)]


if __name__ == "__main__":
    raise SystemExit(not tell(__doc__, measure(20.0)))
