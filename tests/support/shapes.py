"""A task of twenty-five gestemes: as many human drawings as there are, in any order."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hmcs.motion.chains import chained
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.lasa import read_drawing, shapes
from hmcs.motion.steps import Step, steps_of
from hmcs.recognition.learning import learn
from hmcs.recognition.model_file import save_model
from hmcs.task import Task, load_task

COUNT = 25
SHAPES = tuple(shape for shape in shapes() if not shape.startswith("Multi"))[:COUNT]


def any_order_task() -> Task:
    """Return a task whose states each are one shape, any of them after any other."""
    like = load_task("human-shapes")
    states = [f"draw-{shape}" for shape in SHAPES]
    return Task.model_validate(
        {
            "format": "hmcs-task/1",
            "name": "any-order",
            "dead_zone_m": like.dead_zone_m,
            "gestemes": [{"name": shape} for shape in SHAPES],
            "states": [
                {"name": state, "gestemes": [shape], "next": states}
                for state, shape in zip(states, SHAPES, strict=True)
            ],
            "start": states,
            "recognition": like.recognition.model_dump(),
            "drawings": like.drawings.model_dump() if like.drawings else None,
            "workspace": like.workspace.model_dump(),
            "robot": like.robot.model_dump(),
        }
    )


def train(path: Path, numbers: tuple[int, ...] = (1, 2)) -> None:
    """Write a model of it learned from those drawings of each shape."""
    task = any_order_task()
    drawings = [read_drawing(shape, number, task) for shape in SHAPES for number in numbers]
    save_model(learn(task, drawings), path)


def performance(count: int, seed: int = 0, number: int = 7) -> list[Step]:
    """Return at least `count` steps of drawings one after another in a random order."""
    task, rng = any_order_task(), np.random.default_rng(seed)
    chain: list[Demonstration] = []
    made: list[Step] = []
    while len(made) < count:
        chain += [read_drawing(str(shape), number, task) for shape in rng.permutation(SHAPES)]
        performed = chained("any order", chain, np.array(task.robot.tool_start_m))
        made = steps_of(performed.positions, task.dead_zone_m)
    return made[:count]
