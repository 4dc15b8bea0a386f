"""The model files a fixture controller has loaded, by the name of their recognizer."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from hmcs.bus.service import UserError
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import load_model, model_files


def load_models(places: Iterable[Path]) -> dict[str, Model]:
    """Return the models in files, and in folders of `*.hmcs` files, by name.

    Raises ModelFileError for a file that cannot be used, UserError for a folder without files and
    for two different models of one name.
    """
    models: dict[str, Model] = {}
    for place in places:
        for file in model_files(place):
            model = load_model(file)
            if models.setdefault(model.name, model).hash != model.hash:
                raise UserError(
                    f"{file}: a second, different model named {model.name!r}: leave one of them "
                    "out, or train it under another name"
                )
    return models
