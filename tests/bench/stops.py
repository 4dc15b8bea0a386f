"""Stale commands: input and fixture killed and hung, a hundred times, while the robot moves."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from bench.figures import Figure, tell
from support.stack import Stack
from support.stops import (
    COMMANDED_ZERO_WITHIN_S,
    KINDS,
    STANDS_WITHIN_S,
    FastLoop,
    Trial,
)


def measure(trials_of_each: int) -> list[Figure]:
    """Let every kind of fault happen so often."""
    trials: list[Trial] = []
    for k, (victim, how) in enumerate(KINDS):
        # Each kind with a robot of its own, back where it starts.
        with tempfile.TemporaryDirectory() as folder, Stack(Path(folder) / "logs") as stack:
            loop = FastLoop(stack, Path(folder), np.random.default_rng(k))
            trials += [loop.trial(victim, how) for _ in range(trials_of_each)]
    for trial in trials:
        if not trial.good:
            print(f"  {trial}")
    speeds = [1e3 * trial.speed_m_s for trial in trials]
    zero = [1e3 * trial.commanded_zero_s for trial in trials]
    standing = [1e3 * trial.standing_s for trial in trials]
    return [
        Figure("trials", len(trials)),
        Figure("trials that were not as they must be", sum(not t.good for t in trials), at_most=0),
        Figure("speed at the fault, mean", float(np.mean(speeds)), "mm/s"),
        Figure("commanded zero, median", float(np.median(zero)), "ms"),
        Figure("commanded zero, worst", max(zero), "ms", at_most=1e3 * COMMANDED_ZERO_WITHIN_S),
        Figure("standing, median", float(np.median(standing)), "ms"),
        Figure("standing, worst", max(standing), "ms", at_most=1e3 * STANDS_WITHIN_S),
    ]


if __name__ == "__main__":
    raise SystemExit(not tell(__doc__, measure(25)))
