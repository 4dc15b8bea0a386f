"""The recorder while an input device says where the hand is a thousand times a second."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from bench.figures import Figure, tell
from bench.whole_stack import cpu_s
from hmcs.bus.messages import Ask, Health
from hmcs.recordings.inspection import inspected
from hmcs.recordings.reading import read
from support.stack import Stack
from support.stops import circles

RATE_HZ = 1000
CPU_SHARE = 0.15
"""Of a core."""


def measure(span_s: float) -> list[Figure]:
    """Record for a while; what was lost is counted in the file, by the numbers of its messages."""
    with tempfile.TemporaryDirectory() as place, Stack(Path(place) / "logs") as stack:
        folder = Path(place) / "recordings"
        bus = stack.open_bus("observer", "o")
        stack.watch(bus)
        recorder = stack.bring_up("recorder", "rec", "--folder", folder, "--free-mb", 0)
        stack.bring_up(
            "input_device",
            "i",
            *("--source", "recorded", "--demonstration", circles(Path(place))),
            *("--rate-hz", RATE_HZ, "--repeat", 0, "--lead-in-s", 0.4),
        )
        key = bus.keys.rpc("recorder", "rec", "health")

        def motions() -> int:
            answers = bus.ask(key, Ask(), Health)
            return answers[0].body.received.get("motion", 0) if answers else 0

        stack.until(lambda: motions() > RATE_HZ)
        (before_s,), began_s = cpu_s([recorder]), time.monotonic()
        while time.monotonic() - began_s < span_s:
            bus.pump(0.1)
        (after_s,), lasted_s = cpu_s([recorder]), time.monotonic() - began_s
        recorder.stop()
        (file,) = folder.glob("*.mcap")
        inspection = inspected(read(file))
        size_mb = file.stat().st_size / 1e6
    motion = next(c for c in inspection.channels if c.key.endswith("input/motion"))
    return [
        Figure("samples of the operator recorded", motion.rate_hz, "Hz"),
        Figure(
            "messages lost by the recorder", sum(c.lost for c in inspection.channels), at_most=0
        ),
        Figure("CPU of the recorder", (after_s - before_s) / lasted_s, "cores", at_most=CPU_SHARE),
        Figure("size of the recording", 60 * size_mb / inspection.duration_s, "MB/min"),
    ]


if __name__ == "__main__":
    raise SystemExit(not tell(__doc__, measure(10.0)))
