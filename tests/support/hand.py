"""A hand whose every step is known: an input device in the thread of the test."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hmcs.bus.messages import (
    Belief,
    Command,
    Evidence,
    FixtureState,
    LastSteps,
    LastStepsQuestion,
    Motion,
    Origin,
    RobotState,
    Step,
)
from hmcs.bus.session import Bus, Received, Timer
from hmcs.motion.demonstrations import Demonstration
from hmcs.motion.steps import DeadZone
from hmcs.motion.steps import Step as MotionStep
from support.stack import Stack

PERIOD_S = 0.01
"""Of the samples of a hand that is driven."""
RESTING = 20
"""Samples with the dead-man released before it moves."""


class Hand:
    """Publishes exactly the steps and samples it is given, and answers `last_steps`."""

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.kept: list[tuple[Step, Origin]] = []
        """Everything that can be asked for again, oldest first."""
        self._motions = bus.publisher(Motion, bus.keys.motion)
        self._steps = bus.publisher(Step, bus.keys.step)
        self._samples = 0
        bus.answer("last_steps", LastStepsQuestion, self._last_steps)
        bus.announce(bus.keys.presence(bus.source.service, bus.source.instance))

    @property
    def clock(self) -> str:
        """The boot its steps are counted in."""
        return self.bus.source.boot

    def origin(self) -> Origin:
        """Return the origin of what is caused now."""
        return Origin(boot=self.clock, seq=self._samples, captured_ns=time.monotonic_ns())

    def step(self, step: MotionStep) -> None:
        """Make one step."""
        self._steps.put(*self.keep(step))

    def keep(self, step: MotionStep) -> tuple[Step, Origin]:
        """Make one step that gets lost on its way, so that it must be asked for."""
        self.kept.append((message_of(step), self.origin()))
        return self.kept[-1]

    def repeat(self, index: int) -> None:
        """Send a step again that was made before: what no input device should do."""
        self._steps.put(*self.kept[index])

    def sample(self, position: ArrayLike, velocity: ArrayLike, *, dead_man: bool = True) -> None:
        """Send one sample of the device."""
        motion = Motion(
            position=np.asarray(position, dtype=float),
            velocity=np.asarray(velocity, dtype=float),
            dead_man=dead_man,
        )
        self._samples = self._motions.put(motion, self.origin()).seq + 1

    def play(self, steps: Iterable[MotionStep], rate_hz: float) -> Timer:
        """Make the steps at a steady rate while the bus is pumped."""
        coming: Iterator[MotionStep] = iter(steps)

        def tick() -> None:
            step = next(coming, None)
            if step is None:
                timer.cancel()
            else:
                self.step(step)

        timer = self.bus.every(1.0 / rate_hz, tick)
        return timer

    def _last_steps(self, question: LastStepsQuestion) -> LastSteps:
        end = len(self.kept) if question.before is None else question.before
        chosen = self.kept[max(end - question.count, 0) : end]
        return LastSteps(
            clock=self.clock,
            steps=tuple(step for step, _ in chosen),
            origins=tuple(origin for _, origin in chosen),
        )


class Watcher:
    """Keeps whatever is published for those who watch, in order of arrival."""

    def __init__(self, bus: Bus, *, evidence: bool = True) -> None:
        """Watch everything on `bus`; `evidence` is much and may be left out."""
        self.bus = bus
        keys = bus.keys
        self.beliefs: list[Received[Belief]] = []
        self.evidence: list[Received[Evidence]] = []
        self.fixture: list[Received[FixtureState]] = []
        self.commands: list[Received[Command]] = []
        self.robot: list[Received[RobotState]] = []
        self.motions: list[Received[Motion]] = []
        self.steps: list[Received[Step]] = []
        bus.subscribe(Belief, keys.belief(), self.beliefs.append)
        if evidence:
            bus.subscribe(Evidence, keys.evidence("*"), self.evidence.append)
        bus.subscribe(FixtureState, keys.fixture_state, self.fixture.append)
        bus.subscribe(Command, keys.command, self.commands.append)
        bus.subscribe(RobotState, keys.robot_state, self.robot.append)
        bus.subscribe(Motion, keys.motion, self.motions.append)
        bus.subscribe(Step, keys.step, self.steps.append)

    def belief_of(self, step: int) -> Received[Belief] | None:
        """Return the first belief after a step."""
        return next((r for r in self.beliefs if r.body.step == step), None)

    def evidence_from(self, instance: str) -> dict[int, Evidence]:
        """Return what one classifier has sent, by step."""
        return {
            received.body.step: received.body
            for received in self.evidence
            if received.envelope.source.instance == instance
        }


class Scene:
    """A stack, a hand, and somebody who watches: what most tests begin with."""

    def __init__(self, stack: Stack, *, evidence: bool = True) -> None:
        """Begin with nobody but a hand; `evidence` as `Watcher` takes it."""
        self.stack = stack
        bus = stack.open_bus("input_device", "hand")
        # In a closed cell a hand hears no more than an input device may.
        looks = bus if stack.closed is None else stack.open_bus("operator", "looks")
        stack.watch(looks)
        self.watcher = Watcher(looks, evidence=evidence)
        self.hand = Hand(bus)
        self.bus = bus

    def in_step(self, steps: Iterable[MotionStep], within_s: float = 5.0) -> None:
        """Make the steps, each as soon as there is a belief after the one before."""
        for step in steps:
            wanted = len(self.watcher.beliefs) + 1
            self.hand.step(step)
            self.until_beliefs(wanted, within_s)

    def until_beliefs(self, count: int, within_s: float) -> None:
        """Wait until so many beliefs were seen."""
        self.stack.until(lambda: len(self.watcher.beliefs) >= count, within_s)

    def play(self, steps: list[MotionStep], rate_hz: float) -> None:
        """Make the steps at a steady rate and wait for the belief after the last."""
        self.hand.play(steps, rate_hz)
        last = steps[-1].index
        self.stack.until(lambda: self.watcher.belief_of(last), within_s=len(steps) / rate_hz + 10.0)

    def drive(self, demonstration: Demonstration, dead_zone_m: float = 0.008) -> Timer:
        """Perform with samples and steps while the bus is pumped, the dead-man held.

        Before it the hand rests for a moment with the dead-man released.
        """
        path = _interpolated(demonstration, PERIOD_S)
        zone = DeadZone(dead_zone_m)
        rest = np.repeat(path[:1], RESTING, axis=0)
        coming = iter(enumerate(np.vstack([rest, path])))
        before = path[0]

        def tick() -> None:
            nonlocal before
            count, position = next(coming, (-1, before))
            if count < 0:
                timer.cancel()
                return
            velocity = (position - before) / PERIOD_S
            self.hand.sample(position, velocity, dead_man=count >= RESTING)
            before = position
            step = zone.push(position)
            if step is not None:
                self.hand.step(step)

        timer = self.bus.every(PERIOD_S, tick)
        return timer


def _interpolated(demonstration: Demonstration, period_s: float) -> NDArray[np.float64]:
    times = np.arange(demonstration.time_s[0], demonstration.time_s[-1], period_s)
    columns = [np.interp(times, demonstration.time_s, c) for c in demonstration.positions.T]
    return np.stack(columns, axis=1)


def message_of(step: MotionStep) -> Step:
    """Return a step as it travels."""
    return Step(**step._asdict())


def reported(belief: Belief) -> dict[str, Any]:
    """Return what a belief says in numbers."""
    return {
        "probabilities": belief.probabilities,
        "unknown": belief.unknown,
        "log_likelihood": belief.log_likelihood,
        "mean_log_likelihood": belief.mean_log_likelihood,
    }
