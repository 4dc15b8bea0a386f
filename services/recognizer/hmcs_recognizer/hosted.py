"""One model at work: steps in, one call into its recognizer, beliefs out."""

from __future__ import annotations

import logging

from hmcs.bus.messages import Belief, Evidence
from hmcs.bus.session import Bus
from hmcs.bus.step_feed import FedStep, StepFeed
from hmcs.recognition.model import Model
from hmcs.recognition.recognizer import Recognizer
from hmcs.recognition.registry import kind_named, recognizer_of
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

    def catch_up(self) -> None:
        """Catch up with the motion so far; on any thread, before it begins."""
        self._feed.catch_up()

    def begin(self) -> None:
        """Publish a belief for every step from now on."""
        self._feed.listen()
        self._ready = True
        self._bus.announce(
            self._bus.keys.member(self.model.name, self._service, self._bus.source.instance)
        )

    def renew(self, model: Model, recognizer: Recognizer) -> None:
        """Work with another model of the same name, and its fresh recognizer, from now on."""
        self.model, self.kind = model, kind_named(model.recognizer)
        self._recognizer = recognizer

    def _on_restart(self, index: int) -> None:
        # A motion that is joined in its middle may be in any state of the task.
        self._recognizer = recognizer_of(self.model, anywhere=index > 0)
        self._log.info("beginning anew", extra={"model": self.model.name, "step": index})

    def _on_step(self, fed: FedStep) -> None:
        try:
            recognition = self._recognizer.step(step_of(fed.step))
        except Exception:
            # A recognizer that failed at one step cannot go on; a fresh one may be in any state.
            self._recognizer = recognizer_of(self.model, anywhere=True)
            raise
        if self._ready:
            self.believed += 1
            if recognition.evidence is not None:
                message = evidence_message(self.model, recognition.evidence, fed.clock, "float64")
                self._evidence.put(message, fed.origin)
            self._belief.put(belief_message(self.model, recognition, fed.clock), fed.origin)
