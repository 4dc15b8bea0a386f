"""The models a fixture controller has loaded, by the name of their recognizer."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from hmcs.bus.service import UserError
from hmcs.fixtures.controller.interface import Guides
from hmcs.model_signing import signed_by
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import ModelFileError, load_model, model_file_of, model_files

MOST_LENT = 32
"""So many recognizers of other names may stand on loaded models; the oldest one goes first."""


class Loaded(NamedTuple):
    """A model and what a fixture takes from it."""

    model: Model
    guides: Guides
    file: Path
    """Where the model was read."""


class Recognizers(dict[str, Loaded]):
    """Loaded models by recognizer: each by its own name, and by those that say they stand on it."""

    def __init__(self) -> None:
        super().__init__()
        self._lent: list[str] = []

    def take(self, loaded: Loaded) -> None:
        """Take a model in under its own name, instead of another of that name."""
        self[loaded.model.name] = loaded
        if loaded.model.name in self._lent:
            self._lent.remove(loaded.model.name)

    def of(self, recognizer: str, model_hash: str) -> Loaded | None:
        """Return what a recognizer stands on: the model of its name, or the one of that hash."""
        known = self.get(recognizer)
        if known is not None:
            return known
        return next((known for known in self.values() if known.model.hash == model_hash), None)

    def lend(self, recognizer: str, loaded: Loaded, *, keep: str) -> list[str]:
        """Let a recognizer of another name stand on a model; return those forgotten for it.

        `keep` is not forgotten.
        """
        self[recognizer] = loaded
        self._lent.append(recognizer)
        if len(self._lent) <= MOST_LENT:
            return []
        oldest = next(name for name in self._lent if name != keep)
        self._lent.remove(oldest)
        del self[oldest]
        return [oldest]


def content_of(loaded: Loaded) -> bytes:
    """Return the file of a loaded model as it is on disk.

    Raises ModelFileError where it cannot be read any more, or holds another model by now.
    """
    contents: list[bytes] = []
    model = load_model(loaded.file, verify=lambda _, content: contents.append(content))
    if model.hash != loaded.model.hash:
        raise ModelFileError(
            f"{loaded.file}: holds another model now than the one that is loaded: load it, or name "
            "the file it was"
        )
    return contents[0]


def load_models(
    places: Iterable[Path], model_key: Path | None = None, task: str | None = None
) -> dict[str, tuple[Model, Path]]:
    """Return the models in files, and in folders of `*.hmcs` files, by name, each with its file.

    With a task, its model alone is taken of a folder, if it is there. Raises ModelFileError for a
    file that cannot be used, UserError for a folder without files and for two different models of
    one name.
    """
    models: dict[str, tuple[Model, Path]] = {}
    for place in places:
        for file in _files_in(place, task):
            model = load_model(file, verify=signed_by(model_key))
            known, _ = models.setdefault(model.name, (model, file))
            if known.hash != model.hash:
                raise UserError(
                    f"{file}: a second, different model named {model.name!r}: leave one of them "
                    "out, or train it under another name"
                )
    return models


def _files_in(place: Path, task: str | None) -> list[Path]:
    if task is None:
        return model_files(place)
    file = model_file_of(place, task)
    return [] if file is None else [file]
