"""The service: recognizers of any kind in one process, each a model of its own.

It begins with the model it is told, if any, and takes more while it runs. The layered segment
filter, too, runs here whole; as classifiers and a task HMM it is spread over processes.
"""

from __future__ import annotations

import logging
from pathlib import Path

from hmcs.bus.messages import Done, LoadModel
from hmcs.bus.service import Service
from hmcs.bus.session import Bus
from hmcs.recognition.model_file import load_model
from hmcs_recognizer.hosted import Hosted
from hmcs_recognizer.settings import RecognizerSettings


class RecognizerService(Service):
    """Publishes a belief for every step and every model it has."""

    name = "recognizer"
    Settings = RecognizerSettings
    settings: RecognizerSettings

    def __init__(self, settings: RecognizerSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._hosted: dict[str, Hosted] = {}
        if settings.model is not None:
            self._take(settings.model)

    def start(self) -> None:
        """Catch up with the motion so far, and wait to be given more models."""
        for hosted in self._hosted.values():
            hosted.begin()
        self.bus.answer("load_model", LoadModel, self._load)

    def health(self) -> tuple[bool, str]:
        """Healthy always: a recognizer that waits for steps, or a model, does what it is for."""
        if not self._hosted:
            return True, "waits to be given a model"
        return True, "; ".join(
            f"{name}: {hosted.kind.name}, {hosted.believed} beliefs"
            for name, hosted in self._hosted.items()
        )

    def facts(self) -> dict[str, str]:
        """Return the models and their kinds of recognizer."""
        every = list(self._hosted.values())
        return {
            "model": ", ".join(hosted.model.name for hosted in every),
            "model_hash": ", ".join(hosted.model.hash for hosted in every),
            "recognizer": ", ".join(hosted.kind.name for hosted in every),
            "what": "; ".join(hosted.kind.summary for hosted in every),
            "source": "; ".join(hosted.kind.source for hosted in every),
        }

    def _load(self, asked: LoadModel) -> Done:
        hosted = self._take(Path(asked.path))
        if not hosted.at_work:
            hosted.begin()
        self.log.info("model loaded", extra={"model": hosted.model.name})
        return Done(detail=f"{hosted.model.name} {hosted.model.hash} is at work")

    def _take(self, path: Path) -> Hosted:
        """Work with a model file; raises ModelFileError where it cannot be used."""
        model = load_model(path)
        known = self._hosted.get(model.name)
        if known is not None:
            known.renew(model)
            return known
        hosted = Hosted(model, self.bus, self.log, self.name, self.settings.memory_steps)
        self._hosted[model.name] = hosted
        return hosted
