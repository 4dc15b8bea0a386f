"""The service: steps in, one call into the model's recognizer, beliefs out.

The layered segment filter, too, runs here whole; as classifiers and a task HMM it is spread over
processes.
"""

from __future__ import annotations

import logging

from hmcs.bus.messages import Belief
from hmcs.bus.service import Service
from hmcs.bus.session import Bus
from hmcs.bus.step_feed import FedStep, StepFeed
from hmcs.recognition.model_file import load_model
from hmcs.recognition.recognizers import kind_named, recognizer_of
from hmcs.translation import belief_message, step_of
from hmcs_recognizer.settings import RecognizerSettings


class RecognizerService(Service):
    """Publishes a belief for every step."""

    name = "recognizer"
    Settings = RecognizerSettings

    def __init__(self, settings: RecognizerSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._model = load_model(settings.model)
        self._kind = kind_named(self._model.recognizer)
        self._recognizer = recognizer_of(self._model)
        self._ready = False
        self._believed = 0
        self._belief = bus.publisher(Belief, bus.keys.belief(self._model.name))
        self._feed = StepFeed(
            bus, log, self._on_step, self._on_restart, memory_steps=settings.memory_steps
        )

    def start(self) -> None:
        """Catch up with the motion so far; beliefs begin with the next step."""
        self._feed.begin()
        self._ready = True
        self.bus.announce(
            self.bus.keys.member(self._model.name, self.name, self.bus.source.instance)
        )

    def health(self) -> tuple[bool, str]:
        """Healthy always: a recognizer that waits for steps does what it is for."""
        return True, f"{self._model.name}: {self._kind.name}, {self._believed} beliefs"

    def facts(self) -> dict[str, str]:
        """Return the model and the kind of recognizer."""
        return {
            "model": self._model.name,
            "model_hash": self._model.hash,
            "recognizer": self._kind.name,
            "what": self._kind.summary,
            "source": self._kind.source,
        }

    def _on_restart(self, index: int) -> None:
        # A motion that is joined in its middle may be in any state of the task.
        self._recognizer = recognizer_of(self._model, anywhere=index > 0)
        self.log.info("beginning anew", extra={"step": index})

    def _on_step(self, fed: FedStep) -> None:
        recognition = self._recognizer.step(step_of(fed.step))
        if self._ready:
            self._believed += 1
            self._belief.put(belief_message(self._model, recognition, fed.clock), fed.origin)
