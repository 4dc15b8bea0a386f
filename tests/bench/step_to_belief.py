"""Step → belief: 100 steps/s, 25 gestemes, 2 classifiers that each hold all, beside raw sockets.

Measured from the making of a step to the arrival of its belief, by the process that made the step.
"""

from __future__ import annotations

import tempfile
import threading
import time
from pathlib import Path
from typing import NamedTuple

from bench import sockets
from bench.chains import Stages
from bench.figures import Figure, percentile_ms, tell
from hmcs.bus.examples import ENVELOPE
from hmcs.bus.wire import encode
from hmcs.motion.steps import Step
from support import shapes
from support.hand import Scene, message_of
from support.stack import Stack

RATE_HZ = 100.0
RATIO = 3.0
P99_MS = 10.0
CPU_MS_A_STEP = 1.0
LEAD_IN = 50
"""Steps made before anything counts."""


class OverTheBus(NamedTuple):
    """What the stack did."""

    times_ns: list[int]
    cpu_ms_a_step: float
    """Of the busier classifier."""
    degraded: int
    """Beliefs for which evidence was missing at the deadline of 20 ms."""
    missing: int
    """Steps without a belief."""


def measure(count: int) -> list[Figure]:
    """Measure `count` steps over each, half of the raw sockets before and half after the stack."""
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "any-order.hmcs"
        shapes.train(model)
        steps = shapes.performance(count + LEAD_IN)
        raw = over_sockets(model, steps[: LEAD_IN + count // 2])
        bus = over_the_bus(model, steps, Path(folder))
        raw += over_sockets(model, steps[: LEAD_IN + count // 2])
    ratio = percentile_ms(bus.times_ns, 50) / percentile_ms(raw, 50)
    return [
        Figure("the same stages over raw sockets, p50", percentile_ms(raw, 50), "ms"),
        Figure("the same stages over raw sockets, p99", percentile_ms(raw, 99), "ms"),
        Figure("step to belief, p50", percentile_ms(bus.times_ns, 50), "ms"),
        Figure("step to belief, p99", percentile_ms(bus.times_ns, 99), "ms", at_most=P99_MS),
        Figure("step to belief p50 / the same over raw sockets", ratio, at_most=RATIO),
        Figure("CPU of a classifier a step", bus.cpu_ms_a_step, "ms", at_most=CPU_MS_A_STEP),
        Figure("steps without a belief", bus.missing, at_most=0),
        Figure("beliefs degraded at the default deadline", bus.degraded),
    ]


def over_the_bus(model: Path, steps: list[Step], folder: Path) -> OverTheBus:
    """Make the steps for a task HMM and two classifiers."""
    with Stack(folder / "logs") as stack:
        scene = Scene(stack, evidence=False)
        classifiers = [stack.start("gesteme_classifier", n, "--model", model) for n in "ab"]
        stack.until_ready(*classifiers, stack.start("task_hmm", "t", "--model", model))
        _play(scene, steps[:LEAD_IN])
        before = [stack.health(each).cpu_s for each in classifiers]
        _play(scene, steps[LEAD_IN:])
        spent_s = [
            stack.health(each).cpu_s - cpu_s
            for each, cpu_s in zip(classifiers, before, strict=True)
        ]
        counted = [r for r in scene.watcher.beliefs if r.body.step >= LEAD_IN]
        return OverTheBus(
            [
                r.received_ns - r.envelope.origin.captured_ns
                for r in counted
                if r.envelope.origin is not None
            ],
            max(spent_s) * 1e3 / (len(steps) - LEAD_IN),
            sum(bool(r.body.missing_gestemes) for r in counted),
            len(steps) - LEAD_IN - len(counted),
        )


def _play(scene: Scene, steps: list[Step]) -> None:
    scene.hand.play(steps, RATE_HZ)
    known = len(scene.watcher.beliefs) + len(steps)
    deadline_s = time.monotonic() + len(steps) / RATE_HZ + 2.0
    while len(scene.watcher.beliefs) < known and time.monotonic() < deadline_s:
        scene.bus.pump(0.1)


def over_sockets(model: Path, steps: list[Step]) -> list[int]:
    """Return the times of the same stages on raw sockets, ns."""
    server, port = sockets.listen()
    with Stages() as stages, server:
        task = stages.listening("task", port, "--file", model, "--inputs", 3)
        with sockets.accept(server) as beliefs:
            entries = [stages.listening("classifier", task, "--file", model) for _ in "ab"]
            ways = [sockets.connect(entry) for entry in (*entries, task)]
            times: list[int] = []

            def listen() -> None:
                for frame in sockets.frames(beliefs):
                    times.append(time.monotonic_ns() - frame.caused_ns)

            listening = threading.Thread(target=listen)
            listening.start()
            began_s = time.monotonic()
            for k, step in enumerate(steps):
                time.sleep(max(0.0, began_s + k / RATE_HZ - time.monotonic()))
                made_ns = time.monotonic_ns()
                frame = sockets.Frame(made_ns, encode(message_of(step), ENVELOPE))
                for way in ways:
                    sockets.send(way, frame)
            for way in ways:
                way.close()
            listening.join()
    return times[LEAD_IN:]


if __name__ == "__main__":
    raise SystemExit(not tell(__doc__, measure(2000)))
