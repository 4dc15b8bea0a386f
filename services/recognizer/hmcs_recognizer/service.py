"""The service: recognizers of any kind in one process, each a model of its own.

It begins with the model of its settings, if any, and takes more while it runs. The layered segment
filter, too, runs here whole; as classifiers and a task HMM it is spread over processes.
"""

from __future__ import annotations

import logging
from concurrent.futures import ThreadPoolExecutor

from hmcs.bus.messages import Done, LoadModel
from hmcs.bus.service import Service
from hmcs.bus.session import Bus, RequestRefusedError
from hmcs.bus.verbs import LOAD_MODEL
from hmcs.model_signing import signed_by
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import asked_model, load_model, model_file_of
from hmcs.recognition.registry import DEFAULT, recognizer_of
from hmcs_recognizer.hosted import Hosted
from hmcs_recognizer.settings import RecognizerSettings

MOST_MODELS = 32
"""Models in one process: each costs its share of every step."""


class RecognizerService(Service):
    """Publishes a belief for every step and every model it has."""

    name = "recognizer"
    Settings = RecognizerSettings
    settings: RecognizerSettings

    def __init__(self, settings: RecognizerSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._hosted: dict[str, Hosted] = {}
        self._files = ThreadPoolExecutor(1, thread_name_prefix="files")
        if (model := _first_model(settings)) is not None:
            self._hosted[model.name] = self._host(model)

    def start(self) -> None:
        """Catch up with the motion so far, and wait to be given more models."""
        for hosted in self._hosted.values():
            hosted.catch_up()
            hosted.begin()
        LOAD_MODEL.answer(self.bus, self._load, aside=self._files)

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

    def close(self) -> None:
        """Read no more files."""
        self._files.shutdown(wait=False, cancel_futures=True)

    def _load(self, asked: LoadModel) -> Done:
        """Work with a model file too; on a thread beside the loop, which serves the others.

        Raises ModelFileError where it cannot be used, RequestRefusedError for one too many.
        """
        model = load_model(asked_model(asked.path), verify=signed_by(self.settings.model_key))
        known = self.bus.in_loop(lambda: self._hosted.get(model.name))
        if known is not None:
            fresh = recognizer_of(model, anywhere=True)
            self.bus.in_loop(lambda: known.renew(model, fresh))
        else:
            if len(self._hosted) >= MOST_MODELS:
                raise RequestRefusedError(
                    f"{MOST_MODELS} models are at work here already: start another recognizer "
                    "process for more"
                )
            hosted = self._host(model)
            hosted.catch_up()
            self.bus.in_loop(lambda: self._begin(hosted))
        self.log.info("model loaded", extra={"model": model.name})
        return Done(detail=f"{model.name} {model.hash} is at work")

    def _host(self, model: Model) -> Hosted:
        return Hosted(model, self.bus, self.log, self.name, self.settings.memory_steps)

    def _begin(self, hosted: Hosted) -> None:
        self._hosted[hosted.model.name] = hosted
        hosted.begin()


def _first_model(settings: RecognizerSettings) -> Model | None:
    """Return the model to begin with; None where there is none yet, or others run it."""
    if settings.model is None or (file := model_file_of(settings.model, settings.task)) is None:
        return None
    model = load_model(file, verify=signed_by(settings.model_key))
    return None if settings.model.is_dir() and model.recognizer == DEFAULT else model
