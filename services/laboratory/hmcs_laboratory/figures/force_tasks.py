"""Figure 4.15: the two tasks of section 4.3, with the robot led by its tool."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from hmcs_laboratory.assistance.loop import Run
from hmcs_laboratory.assistance.scenarios import Taught, as_taught
from hmcs_laboratory.figures.drawing import COLORS, FAINT, INK, Drawn, label_space, new_picture
from hmcs_laboratory.figures.experiments import draw_box
from hmcs_laboratory.studies.assistance import Lesson, LoopSettings, performed
from hmcs_laboratory.studies.force_tasks import FREE, ForceTaskSettings, recognized
from hmcs_laboratory.study import seed_from


def trajectories_of_force_tasks(settings: ForceTaskSettings, rng: np.random.Generator) -> Drawn:
    """Draw figure 4.15: a representative trajectory of each task, changes of state marked."""
    picture = new_picture(4.2)
    plane: Any = picture.add_subplot(1, 2, 1)
    space: Any = picture.add_subplot(1, 2, 2, projection="3d")

    surface, run = _one(settings, "surface", rng)
    _, y, z = run.robot.T
    plane.plot(y, z, color=COLORS[0])
    changes = _changes(surface, run)
    plane.plot(*run.robot[changes][:, 1:].T, "o", color=INK)
    plane.set_aspect("equal")
    plane.invert_xaxis()
    plane.set_xlabel("y, m")
    plane.set_ylabel("z, m")
    plane.set_title("strokes on a surface")

    block, led = _one(settings, "object", rng)
    for obstacle in block.task.workspace.obstacles:
        assert obstacle.size_m is not None
        draw_box(space, np.array(obstacle.position_m), np.array(obstacle.size_m), FAINT)
    space.plot(*led.robot.T, color=COLORS[0])
    space.plot(*led.robot[_changes(block, led)].T, "o", color=INK)
    space.view_init(elev=24, azim=-150)
    label_space(space, 3)
    space.xaxis.set_major_locator(MaxNLocator(2))
    space.set_title("around an object")

    right = [
        recognized(each, as_taught(taught, rng), taught)["accuracy"]
        for taught, each in ((surface, run), (block, led))
    ]
    return Drawn(
        picture,
        {"accuracy": right, "touched": [", ".join(sorted(r.touched)) for r in (run, led)]},
        f"Dots are changes of state. {100 * right[0]:.0f} % of the steps of the first and "
        f"{100 * right[1]:.0f} % of the second were recognized while they were made.",
        "Order, gestemes, symbols and number of demonstrations are those of the thesis; how large "
        "its trajectories were it does not say.",
    )


def _one(settings: LoopSettings, family: str, rng: np.random.Generator) -> tuple[Taught, Run]:
    lesson = Lesson(settings, family, settings.operator[0], seed_from(rng))
    known = lesson.model(FREE)
    assert known is not None
    meant = as_taught(lesson.taught, rng)
    operator, seed = settings.operator[0], seed_from(rng)
    return lesson.taught, performed(settings, lesson.taught, meant, FREE, known[0], operator, seed)[
        0
    ]


def _changes(taught: Taught, run: Run) -> NDArray[np.intp]:
    """The samples at which the operator goes over into another segment."""
    progress_m = np.maximum.accumulate(run.progress_m)
    return np.searchsorted(progress_m, taught.ends_m[:-1])
