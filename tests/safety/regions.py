"""Beside a forbidden region: the fixture killed, hung, flooded, its commands forged."""

from __future__ import annotations

import itertools
import tempfile
from pathlib import Path

import numpy as np
from rich.progress import Progress

from bench.figures import Figure
from support.region_faults import INSIDE_M, SHAPES, WAYS, Descent, Trial
from support.stack import Stack


def measure(trials: int, seed: int, progress: Progress) -> list[Figure]:
    """Let so many things go wrong, in turns on plane, box and mesh, while the tool goes down."""
    done = progress.add_task("trials beside a region", total=trials)
    seen: list[Trial] = []
    for number, shape in enumerate(SHAPES):
        count = len(range(number, trials, len(SHAPES)))
        with (
            tempfile.TemporaryDirectory(prefix="hmcs-regions-") as name,
            Stack(Path(name) / "logs") as stack,
        ):
            descent = Descent(stack, Path(name), shape, np.random.default_rng([seed, number]))
            try:
                for how in itertools.islice(itertools.cycle(WAYS), count):
                    seen.append(descent.trial(how))
                    progress.advance(done)
            finally:
                descent.close()
    inside = [trial for trial in seen if trial.nearest_m < -INSIDE_M]
    for trial in inside:
        progress.print(str(trial))
    return [
        Figure("trials", len(seen)),
        Figure("tool farther inside than 0.1 mm, trials", len(inside), at_most=0),
        Figure("deepest", max(0.0, *(-1e3 * t.nearest_m for t in seen)), "mm"),
        Figure("speed toward it at the fault, mean", 1e3 * _mean_speed(seen), "mm/s"),
    ]


def _mean_speed(seen: list[Trial]) -> float:
    return float(np.mean([trial.speed_m_s for trial in seen]))
