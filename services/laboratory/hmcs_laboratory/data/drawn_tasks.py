"""Tasks of human drawings: LASA shapes one after another, some drawings of each left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hmcs.motion.chains import chained
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.lasa import drawings, shapes
from hmcs.task import Task, load_task
from hmcs_laboratory.data.tasks import TaskSet, as_performance, plain_task


def fixed_order(
    training: int, held_out: int, dead_zone_m: float, rng: np.random.Generator
) -> TaskSet:
    """Return the five shapes of the shipped task `human-shapes`, again and again in its order.

    `training` drawings of each, drawn by lot, are there to learn from; `held_out` others are
    performed, a round of all shapes each.
    """
    names = [gesteme.name for gesteme in load_task("human-shapes").gestemes]
    following = dict(zip(names, [*names[1:], names[0]], strict=True))
    task = plain_task(
        "fixed-order",
        {f"draw-{name}": (name, {f"draw-{following[name]}": 1.0}) for name in names},
        [f"draw-{names[0]}"],
        dead_zone_m=dead_zone_m,
        dimensions=2,
    )
    return _stitched(task, [names] * held_out, training, rng)


def any_order(
    count: int, training: int, held_out: int, dead_zone_m: float, rng: np.random.Generator
) -> TaskSet:
    """Return so many shapes, drawn by lot from all, each of which may follow any other.

    Drawings are left out as in `fixed_order`; each round is in a random order.
    """
    names = [str(name) for name in rng.choice(shapes(), size=count, replace=False)]
    share = 1.0 / (count - 1)
    task = plain_task(
        "any-order",
        {
            f"draw-{name}": (name, {f"draw-{other}": share for other in names if other != name})
            for name in names
        },
        [f"draw-{name}" for name in names],
        dead_zone_m=dead_zone_m,
        dimensions=2,
    )
    rounds: list[list[str]] = []
    while len(rounds) < held_out:
        order = [str(name) for name in rng.permutation(names)]
        # The same shape twice in a row would be no switch.
        if not rounds or rounds[-1][-1] != order[0]:
            rounds.append(order)
    return _stitched(task, rounds, training, rng)


def _stitched(
    task: Task, rounds: Sequence[Sequence[str]], training: int, rng: np.random.Generator
) -> TaskSet:
    lots = {gesteme.name: rng.permutation(len(drawings(gesteme.name))) for gesteme in task.gestemes}
    held_out = len(rounds)
    for name, lot in lots.items():
        if held_out + training > len(lot):
            raise ValueError(
                f"{training} drawings to learn from and {held_out} left out, but there are "
                f"{len(lot)} of {name}"
            )
    demonstrations = [
        _labeled(name, int(number))
        for name, lot in lots.items()
        for number in lot[held_out:][:training]
    ]
    motion = chained(
        "performance",
        [_labeled(name, int(lots[name][k])) for k, order in enumerate(rounds) for name in order],
        np.zeros(3),
    )
    return TaskSet(task, tuple(demonstrations), (as_performance(motion, task),), {})


def _labeled(name: str, number: int) -> Demonstration:
    time_s, drawn_m = drawings(name)[number]
    positions = np.zeros((len(drawn_m), 3))
    positions[:, :2] = drawn_m
    return Demonstration(f"{name}/{number + 1}", time_s, positions, (f"draw-{name}",) * len(time_s))
