"""Models that take over and are rolled back while the hand moves: what is lost, and what jumps.

A newcomer that starts takes processor time from everybody on its machine; what the takeover itself
costs is seen where the fixture controller loads the model and where it follows it. Beside both
stands how the commands come while nothing is taken over.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

from bench.figures import Figure, tell
from bench.whole_stack import SHAPES
from hmcs.bus.session import Bus
from hmcs.task import load_task
from hmcs_local.deploying import back, deploy
from hmcs_trainer.performance import perform
from hmcs_trainer.training import train
from support.takeovers import TICK_S, Running, brought_up

WATCHED_S = 2.0
"""So long a newcomer is compared as a shadow."""
GAP_TICKS = 2.0
EXCHANGED = ("is loaded", "follows")
"""What is said when the fixture controller has a model, and when it goes by it."""
EXCHANGE_S = 0.02
"""So near to the moment the fixture has loaded a model, or follows it, a gap is of that."""
FALL_PER_S = 16.0
"""How fast the task's fixture may let go; it takes hold more slowly."""
OVERSHOOT = 1.5
"""An observer hears of ticks not quite as far apart as they were."""


def measure(rounds: int) -> list[Figure]:
    """Let a second model take over, and the first one come back, so often."""
    missing = 0
    exchange_s: list[float] = []
    meanwhile_s: list[float] = []
    quiet_s: list[float] = []
    steps_of_k: list[float] = []
    task = load_task("human-shapes")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        first, second = folder / "first.hmcs", folder / "second.hmcs"
        train("human-shapes", [f"lasa:{shape}/1-5" for shape in SHAPES], first, name="first")
        train("human-shapes", [f"lasa:{shape}/2-4" for shape in SHAPES], second, name="second")
        operator = folder / "operator.csv"
        perform(task, [f"lasa:{shape}/{k}" for k in (6, 7) for shape in SHAPES], operator)
        with brought_up(folder, operator) as running:
            up, control = running.stack.folder, running.control
            running.watched(lambda bus: deploy(bus, control, up, first, watch_s=WATCHED_S))
            told_s: list[float] = []

            def tell_when(what: str) -> None:
                if any(word in what for word in EXCHANGED):
                    told_s.append(time.monotonic())

            acts = (
                lambda bus: deploy(bus, control, up, second, watch_s=WATCHED_S, tell=tell_when),
                lambda bus: back(bus, control, up, tell_when),
                _nothing,
            )
            for act in acts * rounds:
                told_s.clear()
                for heard in (running.beliefs, running.fixtures, running.commands):
                    heard.clear()
                running.watched(act)
                missing += _missing_steps(running)
                steps_of_k += _steps_of_k(running)
                gaps = _gaps(running)
                longest_s = max(gap_s for _, gap_s in gaps)
                if act is _nothing:
                    quiet_s.append(longest_s)
                else:
                    meanwhile_s.append(longest_s)
                    exchange_s.append(
                        max(gap_s for at_s, gap_s in gaps if _is_near(at_s, gap_s, told_s))
                    )
    return [
        Figure("takeovers and returns", 2 * rounds),
        Figure("steps without a belief", missing, at_most=0),
        Figure("longest gap between commands at an exchange, median",
               float(np.median(exchange_s)) / TICK_S, "ticks", at_most=GAP_TICKS),
        Figure("longest gap at an exchange, worst", max(exchange_s) / TICK_S, "ticks"),
        Figure("longest gap, newcomers starting, median",
               float(np.median(meanwhile_s)) / TICK_S, "ticks"),
        Figure("longest gap while nothing is exchanged, median",
               float(np.median(quiet_s)) / TICK_S, "ticks"),
        Figure("largest step of k / what its rate admits", max(steps_of_k), at_most=OVERSHOOT),
    ]  # fmt: skip


def _nothing(bus: Bus) -> None:
    until_s = time.monotonic() + WATCHED_S
    while time.monotonic() < until_s:
        bus.pump(0.1)


def _gaps(running: Running) -> list[tuple[float, float]]:
    """When each gap between two commands began, and how long it was, s."""
    times_s = np.array([each.received_ns for each in running.commands]) / 1e9
    return list(zip(times_s.tolist(), np.diff(times_s).tolist(), strict=False))


def _is_near(at_s: float, gap_s: float, moments_s: list[float]) -> bool:
    return any(at_s - EXCHANGE_S < moment < at_s + gap_s + EXCHANGE_S for moment in moments_s)


def _missing_steps(running: Running) -> int:
    reported = {received.body.step for received in running.beliefs}
    return max(reported) + 1 - min(reported) - len(reported) if reported else 0


def _steps_of_k(running: Running) -> list[float]:
    """Each change of k as a share of what may change between two samples that far apart."""
    heard = [r for r in running.fixtures if r.envelope.origin is not None]
    factors = np.array([received.body.factor for received in heard])
    captured_ns = np.array([r.envelope.origin.captured_ns for r in heard if r.envelope.origin])
    seconds = np.maximum(np.diff(captured_ns) / 1e9, TICK_S)
    return list(np.abs(np.diff(factors)) / (FALL_PER_S * seconds))


if __name__ == "__main__":
    raise SystemExit(not tell(__doc__, measure(5)))
