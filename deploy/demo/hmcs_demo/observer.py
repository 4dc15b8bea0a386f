"""The observer of the demo: records what happens on the bus, and takes part in nothing.

A process of its own, so that drawing a progress line disturbs no measurement.
"""

from __future__ import annotations

import logging
import time
from pathlib import Path
from typing import Any

import numpy as np

from hmcs.bus.keys import ANY
from hmcs.bus.messages import Belief, Command, FixtureState, Motion, Origin, RobotState, Step
from hmcs.bus.service import Service, ServiceSettings, run
from hmcs.bus.session import Bus, Received
from hmcs_demo.progress import PROGRESS, Progress
from hmcs_demo.recording import (
    NO_SAMPLE,
    Beliefs,
    Commands,
    Fixtures,
    Members,
    Motions,
    Recording,
    RobotStates,
    Steps,
    save_recording,
    table,
)

_TELL_EVERY_S = 0.2
_FINISHED_AFTER_S = 1.0
"""Longer than the operator lets go of the dead-man to press it again after a stop."""

NS_PER_S = 1_000_000_000

Rows = list[tuple[Any, ...]]


class ObserverSettings(ServiceSettings):
    """Settings of the observer."""

    output: Path
    """Where the recording is written when the observer is stopped."""


class Observer(Service):
    """Records motion, steps, beliefs, commands, fixture and robot until it is stopped."""

    name = "demo_observer"
    Settings = ObserverSettings
    settings: ObserverSettings

    def __init__(self, settings: ObserverSettings, bus: Bus, log: logging.Logger) -> None:
        super().__init__(settings, bus, log)
        self._states: tuple[str, ...] = ()
        self._motions: Rows = []
        self._steps: Rows = []
        self._beliefs: Rows = []
        self._commands: Rows = []
        self._fixtures: Rows = []
        self._robot: Rows = []
        self._members: Rows = []
        self._newest: Belief | None = None
        self._factor = 0.5
        self._began_ns = 0
        self._ended_ns = 0

    def start(self) -> None:
        """Look at everything from now on."""
        bus, keys = self.bus, self.bus.keys
        bus.subscribe(Motion, keys.motion, self._on_motion)
        bus.subscribe(Step, keys.step, self._on_step)
        bus.subscribe(Belief, keys.belief(ANY), self._on_belief)
        bus.subscribe(Command, keys.command, self._on_command)
        bus.subscribe(FixtureState, keys.fixture_state, self._on_fixture_state)
        bus.subscribe(RobotState, keys.robot_state, self._on_robot_state)
        bus.watch(keys.member(ANY, ANY), self._on_member)
        bus.every(_TELL_EVERY_S, self._tell)

    def close(self) -> None:
        """Write the recording, whole or not at all."""
        unfinished = self.settings.output.with_suffix(".part.npz")
        save_recording(
            unfinished,
            Recording(
                states=np.array(self._states, dtype=np.str_),
                motions=table(Motions, self._motions),
                steps=table(Steps, self._steps),
                beliefs=table(Beliefs, self._beliefs),
                commands=table(Commands, self._commands),
                fixtures=table(Fixtures, self._fixtures),
                robot=table(RobotStates, self._robot),
                members=table(Members, self._members),
            ),
        )
        unfinished.replace(self.settings.output)

    def _on_motion(self, received: Received[Motion]) -> None:
        motion = received.body
        if motion.dead_man:
            self._began_ns = self._began_ns or received.received_ns
            self._ended_ns = 0
        elif self._began_ns:
            self._ended_ns = self._ended_ns or received.received_ns
        cause = _cause(received.envelope.origin)
        self._motions.append((*cause, received.received_ns, motion.position, motion.dead_man))

    def _on_step(self, received: Received[Step]) -> None:
        step, cause = received.body, _cause(received.envelope.origin)
        row = (*cause, received.received_ns, step.index, step.position, step.displacement)
        self._steps.append(row)

    def _on_belief(self, received: Received[Belief]) -> None:
        self._newest = belief = received.body
        self._states = belief.states
        self._beliefs.append(
            (
                received.received_ns,
                belief.step,
                belief.probabilities,
                belief.unknown,
                len(belief.missing_gestemes),
            )
        )

    def _on_command(self, received: Received[Command]) -> None:
        cause = _cause(received.envelope.origin)
        self._commands.append((*cause, received.received_ns, received.body.engaged))

    def _on_fixture_state(self, received: Received[FixtureState]) -> None:
        fixture, cause = received.body, _cause(received.envelope.origin)
        self._factor = fixture.factor
        self._fixtures.append(
            (*cause, received.received_ns, fixture.factor, fixture.engaged, fixture.reason)
        )

    def _on_robot_state(self, received: Received[RobotState]) -> None:
        robot = received.body
        self._robot.append(
            (
                *_cause(received.envelope.origin),
                received.received_ns,
                robot.tool_position,
                robot.tool_twist[:3],
                robot.reference_twist[:3],
                bool(robot.contacts),
                robot.stop,
                ",".join(robot.limited),
            )
        )

    def _on_member(self, key: str, alive: bool) -> None:
        instance = self.bus.keys.member_of(key).instance
        self._members.append((time.monotonic_ns(), instance, alive))

    def _tell(self) -> None:
        belief = self._newest
        finished = (
            self._ended_ns and time.monotonic_ns() - self._ended_ns > _FINISHED_AFTER_S * NS_PER_S
        )
        until_ns = self._ended_ns or (self._motions[-1][2] if self._motions else 0)
        progress = Progress(
            phase="finished" if finished else "moving" if self._began_ns else "waiting",
            moving_s=(until_ns - self._began_ns) / NS_PER_S if self._began_ns else 0.0,
            state=belief.likely_state if belief else "",
            confidence=belief.confidence if belief else 0.0,
            factor=self._factor,
            steps=len(self._steps),
            missing_steps=max(0, len(self._steps) - 1 - len(self._beliefs)),
            lost=self.bus.counters.lost.total(),
        )
        self.log.info(PROGRESS, extra=progress._asdict())


def _cause(origin: Origin | None) -> tuple[int, int]:
    return (NO_SAMPLE, 0) if origin is None else (origin.seq, origin.captured_ns)


if __name__ == "__main__":
    raise SystemExit(run(Observer))
