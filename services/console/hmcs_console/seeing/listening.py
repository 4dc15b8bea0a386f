"""Who is heard of the loops: operator, fixture, robot, and recognizers; kept as it comes."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial

from hmcs.bus.keys import ANY, Member, is_name, recognizer_in
from hmcs.bus.logs import RateLimitedLog
from hmcs.bus.messages import Belief, Evidence, FixtureState, Motion, RobotState, Step
from hmcs.bus.session import Bus, Received
from hmcs_console.seeing.glancing import Glance
from hmcs_console.seeing.hops import FAST, SLOW, cause_of
from hmcs_console.seeing.seen import MOST_RECOGNIZERS, NS_PER_S, Seen
from hmcs_console.seeing.step_evidence import usable

MOST_STATES = 256
"""Of one belief: no task has so many, and each is drawn."""


class Listening:
    """Takes in what the loops tell; all of it on the thread that pumps the bus."""

    def __init__(
        self, bus: Bus, seen: Seen, log: logging.Logger, marked: Callable[[str, int], None]
    ) -> None:
        """Begin to listen; `marked` is called with clock and number of steps the pedal marks."""
        self._marked = marked
        self._bus = bus
        self._seen = seen
        keys = bus.keys
        self._limited = seldom = RateLimitedLog(log)
        loop = seen.in_fast_loop
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
        name = self._recognizer_in(received.key, Belief.SCHEMA)
        if name is None:
            return
        now_s = received.received_ns / NS_PER_S
        wrong = wrong_with(belief)
        if not wrong and not self._seen.admits(now_s, name):
            wrong = f"{MOST_RECOGNIZERS} recognizers are heard already"
        if wrong:
            self._bus.counters.count_refused(Belief.SCHEMA, wrong)
            return
        source = received.envelope.source
        self._seen.on_belief(now_s, name, belief, Member(source.service, source.instance))
        if name == self._seen.active(now_s):
            self._in_slow_loop("belief", received)

    def _on_evidence(self, received: Received[Evidence]) -> None:
        name = self._recognizer_in(received.key, Evidence.SCHEMA)
        if name is None:
            return
        if not usable(received.body):
            self._bus.counters.count_refused(Evidence.SCHEMA, "its arrays do not fit one another")
            return
        self._seen.evident(name, received.body)

    def _recognizer_in(self, key: str, schema: str) -> str | None:
        """The name of a recognizer that stands in a key; what is none is refused."""
        name = recognizer_in(key).model
        if is_name(name):
            return name
        self._bus.counters.count_refused(schema, "its key names no recognizer")
        self._limited.warning("name", "a key names no recognizer: refused", key=key)
        return None

    def _in_slow_loop(self, stage: str, received: Received[Step] | Received[Belief]) -> None:
        origin = received.envelope.origin
        if origin is not None:
            self._seen.in_slow_loop(SLOW.index(stage), cause_of(origin), received.received_ns)


def wrong_with(belief: Belief) -> str:
    """Return why a belief cannot be shown; empty where it can."""
    if len(belief.states) != len(belief.probabilities):
        return "not one probability for each state"
    if len(set(belief.states)) < len(belief.states):
        return "a state stands in it twice"
    if len(belief.states) > MOST_STATES:
        return f"it has more than {MOST_STATES} states"
    return ""
