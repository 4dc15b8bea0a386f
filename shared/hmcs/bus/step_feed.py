"""Steps in order and without gaps, for whoever recognizes.

Recognition is a function of consecutive steps. A feed hears the input device, asks it again for
what was missed, and hands on every step once, in order.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import NamedTuple

from hmcs.bus.keys import ANY
from hmcs.bus.logs import Seldom
from hmcs.bus.messages import LastSteps, LastStepsQuestion, Origin, Step
from hmcs.bus.session import Bus, Received
from hmcs.bus.timers import NS_PER_S

INPUT_SERVICE = "input_device"
TAKEOVER_S = 1.0
"""Another input device is heard only once the present one has been silent for so long."""
_FETCH_TIMEOUT_S = 0.5
_FETCH_AT_MOST = 10_000


class FedStep(NamedTuple):
    """One step, handed on once."""

    step: Step
    origin: Origin | None
    """The operator sample that completed it."""
    clock: str
    """Boot of the input device."""
    received_ns: int
    """When it came, by this process' monotonic clock."""


class StepFeed:
    """Hands on steps; see the module's docstring."""

    def __init__(
        self,
        bus: Bus,
        log: logging.Logger,
        on_step: Callable[[FedStep], None],
        on_restart: Callable[[int], None] = lambda _: None,
        *,
        memory_steps: int = 300,
    ) -> None:
        """Hand every step to `on_step`.

        `on_restart` is told the index of the step that comes next when that step does not follow
        the one before: at the beginning, after a new start of the input device, and after a gap
        that could not be filled. Before it up to `memory_steps` earlier steps are fetched.
        """
        self._bus = bus
        self._seldom = Seldom(log)
        self._on_step = on_step
        self._on_restart = on_restart
        self._memory_steps = memory_steps
        self._clock = ""
        self._instance = ""
        self._next = 0
        self._fetched_until = 0
        self._heard_ns = 0

    def begin(self) -> None:
        """Listen, and hand on the last steps there are; returns when caught up."""
        self._bus.subscribe(Step, self._bus.keys.step, self._on_live)
        last = self._fetch(self._memory_steps, before=None, clock=None)
        if last is not None and last.steps:
            self._take_clock(last.clock, last.instance)
            self._replay(last)

    def _on_live(self, received: Received[Step]) -> None:
        source, index = received.envelope.source, received.body.index
        if source.boot != self._clock:
            busy = received.received_ns - self._heard_ns < TAKEOVER_S * NS_PER_S
            if self._clock and busy and source.instance != self._instance:
                self._refuse(
                    f"step of a second input device {source.instance!r} while "
                    f"{self._instance!r} is alive: stop one of them"
                )
                return
            self._take_clock(source.boot, source.instance)
        self._heard_ns = received.received_ns
        if index < self._next:
            if index >= self._fetched_until:
                self._refuse(f"step {index} came again or jumped back: expected {self._next}")
            return
        if index > self._next or not self._next:
            self._fill_up_to(index)
        self._hand_on(
            FedStep(received.body, received.envelope.origin, self._clock, received.received_ns)
        )

    def _fill_up_to(self, index: int) -> None:
        """Fetch what is missing before step `index`; where that fails, begin anew."""
        missing = index - self._next
        if index and missing:
            count = missing if self._next else min(index, self._memory_steps)
            last = self._fetch(count, before=index, clock=self._clock)
            if last is not None and last.steps and last.steps[-1].index == index - 1:
                self._replay(last)
                return
            self._seldom.warning(
                "gap", "missed steps could not be fetched: beginning anew", step=index
            )
        self._next = index
        self._on_restart(index)

    def _replay(self, last: _Fetched) -> None:
        first = last.steps[0].index
        if first > self._next or not self._next:
            self._next = first
            self._on_restart(first)
        self._fetched_until = last.steps[-1].index + 1
        for step, origin in zip(last.steps, last.origins, strict=True):
            if step.index >= self._next:
                self._hand_on(FedStep(step, origin, last.clock, last.received_ns))

    def _hand_on(self, fed: FedStep) -> None:
        self._next = fed.step.index + 1
        self._on_step(fed)

    def _take_clock(self, clock: str, instance: str) -> None:
        self._clock, self._instance = clock, instance
        self._next = self._fetched_until = 0

    def _fetch(self, count: int, before: int | None, clock: str | None) -> _Fetched | None:
        """Return consecutive last steps of the input device with that clock, or of any."""
        answers = self._bus.ask(
            self._bus.keys.rpc(INPUT_SERVICE, ANY, "last_steps"),
            LastStepsQuestion(count=min(count, _FETCH_AT_MOST), before=before),
            LastSteps,
            timeout_s=_FETCH_TIMEOUT_S,
        )
        for answer in answers:
            body = answer.body
            indices = [step.index for step in body.steps]
            whole = len(body.origins) == len(indices) and indices == list(
                range(indices[0] if indices else 0, (indices[0] if indices else 0) + len(indices))
            )
            if whole and clock in (None, body.clock):
                return _Fetched(
                    body.clock,
                    answer.envelope.source.instance,
                    body.steps,
                    body.origins,
                    time.monotonic_ns(),
                )
        return None

    def _refuse(self, reason: str) -> None:
        self._bus.counters.count_refused(Step.SCHEMA, reason)
        self._seldom.warning("refused step", "step refused", reason=reason)


class _Fetched(NamedTuple):
    clock: str
    instance: str
    steps: tuple[Step, ...]
    origins: tuple[Origin, ...]
    received_ns: int
