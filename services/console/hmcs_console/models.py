"""What is drawn of the task and of what was learned about it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.fixtures.rules import rules_of
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model, model_files
from hmcs.task import Task, load_task
from hmcs_console.geometry import Surface, tube


class Guide(NamedTuple):
    """A learned path as the fixture uses it in a state."""

    points: NDArray[np.float64]
    """From the segment's origin, m, shape (K, 3)."""
    volume: Surface | None
    """About it, within which the fixture is free, from the segment's origin, m; None for none."""


def load_models(places: Iterable[Path]) -> tuple[Model, ...]:
    """Return the models in files, and in folders of `*.hmcs` files.

    Raises ModelFileError for a file that cannot be used, UserError for a folder without files.
    """
    return tuple(load_model(file) for place in places for file in model_files(place))


def task_of(name: str | None, models: tuple[Model, ...]) -> Task | None:
    """Return the task of a name or a file, else that of the first model, if there is one.

    Raises TaskFileError for a task that cannot be read.
    """
    if name is not None:
        return load_task(name)
    return models[0].task if models else None


class Guides:
    """The learned paths of models, with what their tasks ask of the fixture."""

    def __init__(self, models: tuple[Model, ...]) -> None:
        self._models = {model.name: model for model in models}
        self._of_hash = {model.hash: model for model in models}

    def find(self, model: str, model_hash: str, state: str, gesteme: str) -> Guide | None:
        """Return a state's guide by a recognizer's name and its model's hash; None if unknown.

        A recognizer of another name may stand on any model, so the hash goes first.
        """
        found = self._of_hash.get(model_hash) or self._models.get(model)
        if found is None or gesteme not in found.paths:
            return None
        path = found.paths[gesteme]
        volume = rules_of(found.task).in_state(state).volume
        if volume is None:
            return Guide(path.points, None)
        progress = path.arc_length / path.length_m
        spreads = found.spreads[gesteme]
        radii = [
            volume.radius_m(float(share), float(spread))
            for share, spread in zip(progress, spreads, strict=True)
        ]
        return Guide(path.points, tube(path.points, radii))
