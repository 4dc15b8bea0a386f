"""The service: evidence in, one call into the segment filter, beliefs out."""

from __future__ import annotations

import logging
import time

from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.messages import Belief, Evidence, Origin
from hmcs.bus.service import Service
from hmcs.bus.session import Bus, Received
from hmcs.bus.step_feed import FedStep, StepFeed
from hmcs.bus.timers import Timer
from hmcs.layered_start import layered_model
from hmcs.recognition.segment_filter.recognizer import (
    SegmentFilterRecognizer,
    TaskFilter,
    segment_filter_model,
)
from hmcs.translation import belief_message, step_of
from hmcs_task_hmm.gathering import Gathering
from hmcs_task_hmm.reading import UnusableEvidenceError, read_evidence
from hmcs_task_hmm.settings import TaskFilterServiceSettings

_NS_PER_MS = 1_000_000


class TaskFilterService(Service):
    """Publishes a belief for every step, with all evidence or, past the deadline, without."""

    name = "task_hmm"
    Settings = TaskFilterServiceSettings

    def __init__(self, settings: TaskFilterServiceSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._model = layered_model(settings.model, settings.task, settings.model_key)
        self._recognizer = TaskFilter(self._model)
        self._warming: SegmentFilterRecognizer | None = None
        self._gathering = Gathering(
            self._recognizer.gestemes, round(settings.deadline_ms * _NS_PER_MS)
        )
        self._origins: dict[int, Origin | None] = {}
        self._clock = ""
        self._timer: Timer | None = None
        self._degraded = 0
        self._limited = RateLimitedLog(log)
        self._belief = bus.publisher(Belief, bus.keys.belief(self._model.name, bus.source.instance))
        self._feed = StepFeed(
            bus,
            log,
            self._on_step,
            self._on_restart,
            memory_steps=segment_filter_model(self._model).scoring.window_steps + 1,
        )

    def start(self) -> None:
        """Catch up with the motion so far; beliefs begin with the next step."""
        self._warming = SegmentFilterRecognizer(self._model)
        self._feed.begin()
        self._recognizer, self._warming = self._warming.task, None
        self.bus.subscribe(Evidence, self.bus.keys.evidence(self._model.name), self._on_evidence)
        self.bus.announce(
            self.bus.keys.member(self._model.name, self.name, self.bus.source.instance)
        )

    def health(self) -> tuple[bool, str]:
        """Healthy always; tells how many beliefs were degraded."""
        return True, f"{self._model.name}: {self._degraded} degraded beliefs"

    def facts(self) -> dict[str, str]:
        """Return the model."""
        return {"model": self._model.name, "model_hash": self._model.hash}

    def _on_restart(self, index: int) -> None:
        # A motion that is joined in its middle may be in any state of the task.
        anywhere = index > 0
        if self._warming is not None:
            self._warming = SegmentFilterRecognizer(self._model, anywhere=anywhere)
        else:
            self._recognizer = TaskFilter(self._model, anywhere=anywhere)
        self._gathering.restart(index)
        self._origins.clear()
        self.log.info("beginning anew", extra={"step": index})

    def _on_step(self, fed: FedStep) -> None:
        step = fed.step
        self._clock = fed.clock
        if self._warming is not None:
            self._warming.step(step_of(step))
            self._gathering.restart(step.index + 1)
            return
        self._origins[step.index] = fed.origin
        self._gathering.begin(step.index, fed.received_ns)
        self._release()

    def _on_evidence(self, received: Received[Evidence]) -> None:
        message = received.body
        if self._clock and message.clock != self._clock:
            self._refuse("evidence for another input device's steps")
            return
        try:
            evidence = read_evidence(message, self._model)
        except UnusableEvidenceError as error:
            self._refuse(f"{received.envelope.source.instance}: {error}")
            return
        if self._gathering.add(evidence, received.received_ns) == "late":
            self.bus.counters.count_late(Evidence.SCHEMA)
        self._release()

    def _release(self) -> None:
        while (evidence := self._gathering.release(time.monotonic_ns())) is not None:
            recognition = self._recognizer.step(evidence)
            if recognition.belief.missing:
                self._degraded += 1
                names = self._named(recognition.belief.missing)
                self._limited.warning("degraded", "no evidence in time", gestemes=", ".join(names))
            step = evidence.step
            message = belief_message(self._model, recognition, self._clock)
            self._belief.put(message, self._origins.pop(step, None))
        self._set_timer()

    def _set_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        due_ns = self._gathering.due_ns
        self._timer = None if due_ns is None else self.bus.at(due_ns, self._on_deadline)

    def _on_deadline(self) -> None:
        # What arrived before the deadline may still wait to be handled: it goes first.
        now_ns = time.monotonic_ns()
        self.bus.soon(lambda: self._on_caught_up(now_ns))

    def _on_caught_up(self, now_ns: int) -> None:
        self._gathering.caught_up(now_ns)
        self._release()

    def _named(self, gestemes: tuple[int, ...]) -> tuple[str, ...]:
        return tuple(self._model.gesteme_names[g] for g in gestemes)

    def _refuse(self, reason: str) -> None:
        self.bus.counters.count_refused(Evidence.SCHEMA, reason)
        self._limited.warning("refused", "evidence refused", reason=reason)
