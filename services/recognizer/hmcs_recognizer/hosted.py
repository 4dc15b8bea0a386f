"""One model at work: steps in, one call into its recognizer, beliefs out."""

from __future__ import annotations

import logging

from hmcs.bus.messages import Belief, Evidence
from hmcs.bus.session import Bus
from hmcs.bus.step_feed import FedStep, StepFeed
from hmcs.recognition.model import Model
from hmcs.recognition.recognizers import kind_named, recognizer_of
from hmcs.translation import belief_message, evidence_message, step_of


class Hosted:
    """Publishes a belief for every step, under the name of its model, and the evidence it stands
    on, where it has a layer of gesteme models."""

    def __init__(
        self, model: Model, bus: Bus, log: logging.Logger, service: str, memory_steps: int
    ) -> None:
        self.model = model
        self.kind = kind_named(model.recognizer)
        self.believed = 0
        self._bus, self._log, self._service = bus, log, service
        self._recognizer = recognizer_of(model)
        self._ready = False
        self._belief = bus.publisher(Belief, bus.keys.belief(model.name, bus.source.instance))
        self._evidence = bus.publisher(Evidence, bus.keys.evidence(model.name, bus.source.instance))
        self._feed = StepFeed(bus, log, self._on_step, self._on_restart, memory_steps=memory_steps)

    @property
    def at_work(self) -> bool:
        """Whether it has caught up with the motion, and publishes."""
        return self._ready

    def begin(self) -> None:
        """Catch up with the motion so far; beliefs begin with the next step."""
        self._feed.begin()
        self._ready = True
        self._bus.announce(
            self._bus.keys.member(self.model.name, self._service, self._bus.source.instance)
        )

    def renew(self, model: Model) -> None:
        """Work with another model of the same name from the next step on, as one that is new."""
        self.model, self.kind = model, kind_named(model.recognizer)
        self._recognizer = recognizer_of(model, anywhere=True)

    def _on_restart(self, index: int) -> None:
        # A motion that is joined in its middle may be in any state of the task.
        self._recognizer = recognizer_of(self.model, anywhere=index > 0)
        self._log.info("beginning anew", extra={"model": self.model.name, "step": index})

    def _on_step(self, fed: FedStep) -> None:
        recognition = self._recognizer.step(step_of(fed.step))
        if self._ready:
            self.believed += 1
            if recognition.evidence is not None:
                told = evidence_message(self.model, recognition.evidence, fed.clock, "float64")
                self._evidence.put(told, fed.origin)
            self._belief.put(belief_message(self.model, recognition, fed.clock), fed.origin)
