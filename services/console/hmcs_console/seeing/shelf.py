"""The models there are in folders: what they were learned from, and which of them has a report."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from hmcs.errors import UserError
from hmcs.recognition.model_file import load_model, model_files
from hmcs_console.seeing.reports import report_name

LOOK_EVERY_S = 2.0
"""How often folders are looked at."""
MOST_MODELS = 256
_PART = re.compile(r"#\d{1,9}")
"""Of a recording with several demonstrations, after its name."""


class Shelved(NamedTuple):
    """A model in a folder."""

    name: str
    hash: str
    recognizer: str
    """The kind it was learned for."""
    demonstrations: tuple[str, ...]
    """Names of those it was learned from."""
    report: str = ""
    """Name its report is served by; empty where it has none."""


class Shelf:
    """Keeps what is known of model files; each is read once, and again where it has changed.

    All is done on the thread that draws: a file is small.
    """

    def __init__(self, places: Iterable[Path], clock: Callable[[], float] = time.monotonic) -> None:
        """Look into files, and folders of `*.hmcs` files, which may fill later."""
        self._places = tuple(places)
        self._clock = clock
        self._looked_s = -LOOK_EVERY_S
        self._known: dict[tuple[Path, int, int], Shelved | None] = {}
        """By file, time of its last change, and size; None for one that cannot be used."""
        self._models: tuple[Shelved, ...] = ()

    def look(self) -> tuple[Shelved, ...]:
        """Return the models there are, the newest first."""
        if self._clock() - self._looked_s >= LOOK_EVERY_S:
            self._looked_s = self._clock()
            self._known = {stamp: self._at(stamp) for stamp in self._stamps()}
            newest = sorted(self._known, key=lambda stamp: stamp[1], reverse=True)
            models = [
                known._replace(report=report_name(stamp[0]))
                for stamp in newest
                if (known := self._known[stamp]) is not None
            ]
            if tuple(models) != self._models:
                self._models = tuple(models)
        return self._models

    def _stamps(self) -> Iterator[tuple[Path, int, int]]:
        files: list[Path] = []
        for place in self._places:
            with suppress(OSError, UserError):
                files += model_files(place, may_be_empty=True)
        for file in files[:MOST_MODELS]:
            with suppress(OSError):
                status = file.stat()
                yield file, status.st_mtime_ns, status.st_size

    def _at(self, stamp: tuple[Path, int, int]) -> Shelved | None:
        if stamp in self._known:
            return self._known[stamp]
        with suppress(UserError, OSError, ValueError, MemoryError, RecursionError):
            model = load_model(stamp[0])
            return Shelved(model.name, model.hash, model.recognizer, model.demonstrations)
        return None


def active_first(models: tuple[Shelved, ...], active: str, model_hash: str) -> tuple[Shelved, ...]:
    """Return models with that of the active recognizer first; it need not lie in any folder.

    `model_hash` is what it stands on; empty where it has reported none, then its name counts.
    """
    own = [model for model in models if model_hash in ("", model.hash)]
    if not model_hash:
        own = [model for model in own if model.name == active]
    elif not own and active:
        own = [Shelved(active, model_hash, "", ())]
    return (*own[:1], *(model for model in models if model not in own[:1]))


def learned_from(models: Iterable[Shelved], recording: str) -> tuple[Shelved, ...]:
    """Return the models that were learned from a recording, by the name of its file."""
    return tuple(
        model
        for model in models
        if any(_is_of(demonstration, recording) for demonstration in model.demonstrations)
    )


def labels_of(models: Iterable[Shelved]) -> dict[str, Shelved]:
    """Return models by what a list calls them: names, with the hash of one that is there twice."""
    named: dict[str, Shelved] = {}
    for model in models:
        name = model.name if model.name not in named else f"{model.name} {model.hash[:8]}"
        named.setdefault(name, model)
    return named


def _is_of(demonstration: str, recording: str) -> bool:
    file = demonstration.rpartition("/")[2]
    return file == recording or (
        file.startswith(recording) and _PART.fullmatch(file[len(recording) :]) is not None
    )
