"""Ten minutes at 100 Hz, the router started anew now and then, visitors coming and going."""

from __future__ import annotations

import signal
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil
from rich.progress import Progress

from bench.figures import Figure
from fuzz.campaign import Besieged
from hmcs.bus.messages import Ask
from hmcs.bus.session import Bus
from hmcs.bus.verbs import HEALTH
from support.stack import Stack
from support.taught import taught

MB_AN_HOUR = 1.0
_WARM_UP_SHARE = 0.3
"""What a process takes in its first minutes it keeps: caches, histories of bounded length."""
_LOOK_EVERY_S = 2.0
_ROUTER_EVERY_S = 120.0


def measure(minutes: float, progress: Progress) -> list[Figure]:
    """Watch how much memory each process holds."""
    done = progress.add_task("memory", total=60 * minutes)
    with tempfile.TemporaryDirectory(prefix="hmcs-memory-") as name:
        folder = Path(name)
        model, performance = taught(folder)
        with (
            Stack(folder / "logs") as stack,
            Besieged(stack, folder, model, performance) as at_work,
        ):
            held: dict[str, list[tuple[float, float]]] = {s: [] for s in at_work.processes}
            begun_s = router_s = time.monotonic()
            while (passed_s := time.monotonic() - begun_s) < 60 * minutes:
                if time.monotonic() - router_s > _ROUTER_EVERY_S:
                    router_s = time.monotonic()
                    stack.router.send(signal.SIGKILL)
                    stack.router.wait(10.0)
                    stack.start_router()
                _visit(stack)
                for service, process in at_work.processes.items():
                    held[service].append((passed_s, _held_mb(process.pid)))
                stack.elapse(_LOOK_EVERY_S)
                progress.update(done, completed=passed_s)
    return [
        Figure(f"{service}, growth", _mb_an_hour(seen), "MB/h", at_most=MB_AN_HOUR)
        for service, seen in held.items()
    ]


def _visit(stack: Stack) -> None:
    """Come, ask everybody how it is, and go."""
    settings = stack.settings("observer").model_copy(update={"connect_timeout_s": 30.0})
    with Bus.open(settings, "observer", "visitor") as bus:
        HEALTH.ask(bus, Ask(), service="*", timeout_s=1.0)


def _held_mb(pid: int) -> float:
    """Return what a process and its children hold for themselves alone, MB."""
    process = psutil.Process(pid)
    family = (process, *process.children(recursive=True))
    return sum(each.memory_full_info().uss for each in family) / 1e6


def _mb_an_hour(seen: list[tuple[float, float]]) -> float:
    """Return the slope of a line through what was held after the warm-up, MB/h."""
    time_s, held_mb = np.array(seen).T
    late = time_s > _WARM_UP_SHARE * time_s[-1]
    slope, _ = np.polyfit(time_s[late], held_mb[late], 1)
    return float(3600 * slope)
