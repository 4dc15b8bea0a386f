"""Performances: demonstrations chained into one recording for the input device to play."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hmcs.motion.chains import chained, closed
from hmcs.motion.demonstrations import Demonstration, write_csv
from hmcs.task import Task
from hmcs_trainer.references import read_references


def perform(
    task: Task, references: list[str], output: str | Path, *, ring: bool = False
) -> Demonstration:
    """Chain the demonstrations, beginning where the robot's tool does, and write them as CSV.

    With `ring` the chain is bent to end where it began, to be played over and over.

    Raises DemonstrationError for a reference that names none or a file that cannot be written.
    """
    demonstrations = read_references(references, task)
    target = Path(output)
    performance = chained(target.stem, demonstrations, np.array(task.robot.tool_start_m))
    if ring:
        performance = closed(performance)
    write_csv(target, performance)
    return performance
