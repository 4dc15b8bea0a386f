"""Who is heard of the loops: operator, fixture, robot, and recognizers; kept as it comes."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial

from hmcs.bus.keys import ANY
from hmcs.bus.logs import Seldom
from hmcs.bus.messages import Belief, Evidence, FixtureState, Motion, RobotState, Step
from hmcs.bus.session import Bus, Received
from hmcs_console.seeing.gathered import usable
from hmcs_console.seeing.glancing import Glance
from hmcs_console.seeing.hops import FAST, SLOW, cause_of
from hmcs_console.seeing.seen import NS_PER_S, Seen


class Listening:
    """Takes in what the loops tell; all of it on the thread that pumps the bus."""

    def __init__(
        self, bus: Bus, seen: Seen, log: logging.Logger, marked: Callable[[str, int], None]
    ) -> None:
        """Begin to listen; `marked` is told clock and number of each step the pedal marks."""
        self._marked = marked
        self._bus = bus
        self._seen = seen
        keys = bus.keys
        loop, seldom = seen.in_fast_loop, Seldom(log)
        Glance(
            bus,
            Motion,
            keys.motion,
            seldom,
            partial(loop, FAST.index("input")),
            lambda got: seen.hand_moved(got.body),
        )
        Glance(
            bus,
            FixtureState,
            keys.fixture_state,
            seldom,
            partial(loop, FAST.index("fixture")),
            lambda got: seen.fixture_changed(got.received_ns / NS_PER_S, got.body),
        )
        Glance(
            bus,
            RobotState,
            keys.robot_state,
            seldom,
            partial(loop, FAST.index("robot")),
            lambda got: seen.robot_moved(got.received_ns / NS_PER_S, got.body),
        )
        bus.subscribe(Step, keys.step, self._on_step)
        bus.subscribe(Belief, keys.belief(ANY), self._on_belief)
        bus.subscribe(Evidence, keys.evidence(ANY), self._on_evidence)

    def _on_step(self, received: Received[Step]) -> None:
        self._seen.clock = received.envelope.source.boot
        self._seen.step = received.body
        if received.body.mark:
            self._marked(received.envelope.source.boot, received.body.index)
        self._in_slow_loop("step", received)

    def _on_belief(self, received: Received[Belief]) -> None:
        belief = received.body
        if len(belief.states) != len(belief.probabilities):
            self._bus.counters.count_refused(Belief.SCHEMA, "not one probability for each state")
            return
        before, after = self._bus.keys.belief(ANY).split(ANY)
        name = received.key.removeprefix(before).removesuffix(after)
        now_s = received.received_ns / NS_PER_S
        self._seen.believed(now_s, name, belief)
        if name == self._seen.active(now_s):
            self._in_slow_loop("belief", received)

    def _on_evidence(self, received: Received[Evidence]) -> None:
        if not usable(received.body):
            self._bus.counters.count_refused(Evidence.SCHEMA, "its arrays do not fit one another")
            return
        before, after = self._bus.keys.evidence(ANY).split(ANY)[:2]
        name = received.key.removeprefix(before).split(after)[0]
        self._seen.evident(name, received.body)

    def _in_slow_loop(self, stage: str, received: Received[Step] | Received[Belief]) -> None:
        origin = received.envelope.origin
        if origin is not None:
            self._seen.in_slow_loop(SLOW.index(stage), cause_of(origin), received.received_ns)
