"""Steps in order and without gaps, of the one device that drives, for every recognizer.

Recognition is a function of consecutive steps. A feed hears the input device, asks it again for
what was missed, and hands on every step once, in order. Which device that is the fixture controller
decides (`Pairing`); where none is heard, the same rule is applied to the steps themselves.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import NamedTuple

from hmcs.bus.keys import ANY, is_name
from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.messages import LastStepsQuestion, Origin, Pairing, Step
from hmcs.bus.session import Bus, Received
from hmcs.bus.timers import NS_PER_S
from hmcs.bus.verbs import LAST_STEPS
from hmcs.driving import Device, heard_device

PAIRING_FRESH_S = 1.0
"""A pairing not heard again for so long says nothing any more: its fixture controller is gone."""
LARGEST_JUMP = 10_000
"""No step so far ahead is taken over unless the device itself confirms it."""
RESYNCHRONIZED_EVERY_S = 1.0
"""So seldom the device is asked whether a step that jumped back is its newest."""
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

        `on_restart` receives the index of the step that comes next when that step does not follow
        the one before: at the beginning, after a new start of the input device, and after a gap
        that could not be filled. Before it up to `memory_steps` earlier steps are fetched.
        """
        self._bus = bus
        self._limited = RateLimitedLog(log)
        self._on_step = on_step
        self._on_restart = on_restart
        self._memory_steps = memory_steps
        self._device = Device()
        self._pairing: Received[Pairing] | None = None
        self._clock = ""
        self._instance = ""
        self._next = 0
        self._fetched_until = 0
        self._resynchronized_ns = -RESYNCHRONIZED_EVERY_S * NS_PER_S

    def begin(self) -> None:
        """Listen, and hand on the last steps there are; returns when caught up."""
        self.listen()
        self.catch_up()

    def listen(self) -> None:
        """Listen from now on; steps made since the last one handed on are fetched with the next."""
        self._bus.subscribe(Step, self._bus.keys.step, self._on_live)
        self._bus.subscribe(Pairing, self._bus.keys.pairing, self._on_pairing)

    def catch_up(self) -> None:
        """Hand on the last steps there are.

        On the loop's thread, or on another one before this feed listens.
        """
        self._catch_up(self._fetch(self._memory_steps, before=None, clock=None))

    def _on_pairing(self, received: Received[Pairing]) -> None:
        self._pairing = received
        device = received.body.device
        if device and device != self._clock:
            found = self._fetch(
                self._memory_steps, before=None, clock=device, of=received.body.device_instance
            )
            self._take_clock(device, received.body.device_instance, received.received_ns)
            self._catch_up(found)

    def _on_live(self, received: Received[Step]) -> None:
        source, index = received.envelope.source, received.body.index
        if not self._drives(received):
            self._refuse(
                f"step of {source.instance!r}, while {self._instance!r} is the input device that "
                "drives: let go there, or stop one of them"
            )
            return
        if source.boot != self._clock:
            self._take_clock(source.boot, source.instance, received.received_ns)
        if index < self._next:
            if index >= self._fetched_until and not self._resynchronized(
                index, received.received_ns
            ):
                self._refuse(f"step {index} came again or jumped back: expected {self._next}")
            return
        if (index > self._next or not self._next) and not self._fill_up_to(index):
            return
        self._hand_on(
            FedStep(received.body, received.envelope.origin, self._clock, received.received_ns)
        )

    def _drives(self, received: Received[Step]) -> bool:
        """Whether a step is of the device that drives."""
        source, now_ns = received.envelope.source, received.received_ns
        # A step is made by an engaged hand, so its device's dead-man is down.
        self._device = heard_device(
            self._device, now_ns / NS_PER_S, source.boot, source.instance, pressed=True
        )
        pairing = self._pairing
        fresh = (
            pairing is not None
            and now_ns - pairing.received_ns < PAIRING_FRESH_S * NS_PER_S
            and pairing.body.device
        )
        return source.boot == (pairing.body.device if pairing and fresh else self._device.boot)

    def _fill_up_to(self, index: int) -> bool:
        """Fetch what is missing before step `index`, or begin anew there where that fails.

        Returns False where the device does not know that step: then it is somebody else's.
        """
        missing = index - self._next
        if index and missing:
            count = missing if self._next else min(index, self._memory_steps)
            last = self._fetch(count, before=index, clock=self._clock, of=self._instance)
            newest = last.steps[-1].index if last is not None and last.steps else None
            if last is not None and newest == index - 1:
                self._replay(last)
                return True
            if newest is not None or missing > LARGEST_JUMP:
                self._refuse(
                    f"step {index}, while the device that drives has made "
                    f"{self._next if newest is None else newest + 1}"
                )
                return False
            self._limited.warning(
                "gap", "missed steps could not be fetched: beginning anew", step=index
            )
        self._next = index
        self._on_restart(index)
        return True

    def _resynchronized(self, index: int, now_ns: int) -> bool:
        """Whether this feed was ahead of its device, which made step `index` just now.

        It has then begun anew with the device's own steps.
        """
        if now_ns - self._resynchronized_ns < RESYNCHRONIZED_EVERY_S * NS_PER_S:
            return False
        self._resynchronized_ns = now_ns
        last = self._fetch(self._memory_steps, before=None, clock=self._clock, of=self._instance)
        newest = last.steps[-1].index if last is not None and last.steps else -1
        if last is None or not index <= newest < self._next - 1:
            return False
        self._take_clock(self._clock, self._instance, now_ns)
        self._replay(last)
        return True

    def _catch_up(self, last: _Fetched | None) -> None:
        if last is not None and last.steps:
            self._take_clock(last.clock, last.instance, last.received_ns)
            self._replay(last)

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

    def _take_clock(self, clock: str, instance: str, now_ns: int) -> None:
        self._device = heard_device(Device(), now_ns / NS_PER_S, clock, instance, pressed=True)
        self._clock, self._instance = clock, instance
        self._next = self._fetched_until = 0

    def _fetch(
        self, count: int, before: int | None, clock: str | None, of: str = ANY
    ) -> _Fetched | None:
        """Return consecutive last steps of the input device with that clock, or of any.

        `of` is its instance.
        """
        answers = LAST_STEPS.ask(
            self._bus,
            LastStepsQuestion(count=min(count, _FETCH_AT_MOST), before=before),
            instance=of if is_name(of) else ANY,
            timeout_s=_FETCH_TIMEOUT_S,
        )
        for answer in answers:
            body = answer.body
            indices = [step.index for step in body.steps]
            first = indices[0] if indices else 0
            whole = len(body.origins) == len(indices) and indices == list(
                range(first, first + len(indices))
            )
            mine = body.clock == answer.envelope.source.boot
            if whole and mine and clock in (None, body.clock):
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
        self._limited.warning("refused step", "step refused", reason=reason)


class _Fetched(NamedTuple):
    clock: str
    instance: str
    steps: tuple[Step, ...]
    origins: tuple[Origin, ...]
    received_ns: int
