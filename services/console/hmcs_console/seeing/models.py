"""What is drawn of the task and of what was learned about it."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.errors import UserError
from hmcs.fixtures.controller.rules import rules_of
from hmcs.fixtures.guides.volumes import volume_radius_m
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model, model_files, model_in
from hmcs.shown import plain
from hmcs.task import Task, load_task
from hmcs_console.shapes.geometry import Surface, tube

MOST_MODELS, MOST_TOLD, MOST_MISSED = 256, 16, 256
"""Models that are kept, files that others named, and hashes of which no file was found."""
_MOST_GIVEN = 2
READ_EVERY_S = 2.0
"""How often files are looked at for a model that is not known."""
_LONGEST_PATH = 4096


class Guide(NamedTuple):
    """A learned path as the fixture uses it in a state."""

    points: NDArray[np.float64]
    """From the segment's origin, m of the robot, shape (K, 3)."""
    volume: Surface | None
    """About it, within which the fixture is free, from the segment's origin, m; None for none."""


def load_models(places: Iterable[Path]) -> tuple[Model, ...]:
    """Return the models in files, and in folders of `*.hmcs` files; a folder may fill later.

    Raises ModelFileError for a file that cannot be used.
    """
    return tuple(
        load_model(file) for place in places for file in model_files(place, may_be_empty=True)
    )


def task_of(name: str | None, models: tuple[Model, ...]) -> Task | None:
    """Return the task of a name or a file, else that of the first model, if there is one.

    Raises TaskFileError for a task that cannot be read.
    """
    if name is not None:
        return load_task(name)
    return models[0].task if models else None


def gesteme_of(model: Model, state: str) -> str:
    """Return the gesteme a state is performed with, of several the first one in the task's file.

    Empty where the task has no such state.
    """
    gestemes = (known.gestemes for known in model.task.states if known.name == state)
    return next(gestemes, ("",))[0]


def guide_of(model: Model, state: str, gesteme: str) -> Guide | None:
    """Return a guide of a model as large as the robot is led; None where it has no such gesteme."""
    if gesteme not in model.gesteme_names:
        return None
    path, fixture = model.paths[gesteme], rules_of(model.task).in_state(state).fixture
    points = fixture.operator_scale * path.points
    if fixture.volume is None:
        return Guide(points, None)
    progress = path.arc_length / path.length_m
    radii = [
        fixture.operator_scale * volume_radius_m(fixture.volume, float(share), float(spread))
        for share, spread in zip(progress, model.spreads[gesteme], strict=True)
    ]
    return Guide(points, tube(points, radii))


class Models:
    """The models that are known here; one that somebody follows is looked for in files.

    All is done on the thread that draws: a file is small, and read once.
    """

    def __init__(
        self,
        models: Sequence[Model],
        places: Iterable[Path],
        log: logging.Logger,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Begin with some; `places` are files and folders where others may come to be."""
        self._log = log
        self._clock = clock
        self._named = {model.name: model for model in models}
        self._hashed = {model.hash: model for model in models}
        self._places = tuple(places)
        self._named_files: deque[Path] = deque(maxlen=MOST_TOLD)
        self._missed: deque[str] = deque(maxlen=MOST_MISSED)
        self._given: deque[bytes] = deque(maxlen=_MOST_GIVEN)
        self._read_s = -READ_EVERY_S
        self.wanted: tuple[str, str] | None = None
        """Name and hash of the model that is followed and not known here; the hash is empty as
        long as nobody has reported one."""

    def look_in(self, path: str) -> None:
        """Look in a file, too, which somebody says was written just now."""
        if plain(path, _LONGEST_PATH) == path and path.endswith(".hmcs"):
            self._named_files.append(Path(path))
            self._missed.clear()

    def give(self, content: bytes) -> None:
        """Take in the file of a model that is wanted, from wherever it came; on any thread."""
        self._given.append(content)

    def find(self, recognizer: str, model_hash: str) -> Model | None:
        """Return the model a recognizer stands on, by its hash; None where it is not known here.

        A recognizer of another name may stand on any model, so its name counts only as long as it
        has reported no hash, which is empty then.
        """
        while self._given:
            self._take_given(self._given.popleft())
        known = self._known(recognizer, model_hash)
        self.wanted = None if known is not None or not recognizer else (recognizer, model_hash)
        return known

    def _known(self, recognizer: str, model_hash: str) -> Model | None:
        if not model_hash:
            return self._named.get(recognizer)
        known = self._hashed.get(model_hash)
        if known is not None or model_hash in self._missed:
            return known
        # A sender that names ever new models has no file read more often for it.
        if self._clock() - self._read_s < READ_EVERY_S:
            return None
        self._read_s = self._clock()
        self._read_files()
        if model_hash not in self._hashed:
            self._missed.append(model_hash)
            self._log.info(
                "no file of this model is seen here: its guides are not drawn",
                extra={"recognizer": recognizer, "hash": model_hash},
            )
        return self._hashed.get(model_hash)

    def _read_files(self) -> None:
        for place in (*self._places, *self._named_files):
            # Paths are given as another process sees them, and files may be half written.
            with suppress(UserError, OSError, ValueError, MemoryError, RecursionError):
                for file in model_files(place):
                    with suppress(UserError, OSError, ValueError, MemoryError, RecursionError):
                        self._take(load_model(file))

    def _take_given(self, content: bytes) -> None:
        # What is no model, or too large, is not drawn.
        with suppress(UserError, ValueError, MemoryError, RecursionError):
            self._take(model_in(content, Path("a model that was sent")))

    def _take(self, model: Model) -> None:
        if len(self._hashed) < MOST_MODELS:
            self._named[model.name] = self._hashed[model.hash] = model
