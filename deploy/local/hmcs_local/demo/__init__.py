"""The demo: the whole stack on held-out human motion, measured, with a report to look at."""

from __future__ import annotations

from pathlib import Path


def run_demo(*, output: Path, seed: int, held_out: tuple[int, ...]) -> int:
    """Run the demo and put its report into `output`; return the exit code, see `demo.run`."""
    # Imported here, because the observer is a process of this package and needs none of it.
    from hmcs_local.demo.run import run

    return run(output=output, seed=seed, held_out=held_out)
