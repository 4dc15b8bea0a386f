"""The run itself: bring the stack up, let the hand play, swap a classifier, see it to its end."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from hmcs.bus.messages import Ask, Health
from hmcs.bus.session import Bus
from hmcs.bus.verbs import HEALTH
from hmcs_demo.cpu import CpuMeter
from hmcs_demo.observer import Observer
from hmcs_demo.progress import PROGRESS, Progress, ProgressLine
from hmcs_demo.truth import RunError
from hmcs_local.compose import own_compose
from hmcs_local.connecting import open_observer
from hmcs_local.observer import Sighting, look
from hmcs_local.processes import StackProcess
from hmcs_local.stack import LocalStack

ROBOT = "robot"
SERVICES = (
    "router",
    "input-device",
    "gesteme-classifier",
    "task-hmm",
    "fixture-controller",
    ROBOT,
)
CLASSIFIER = "gesteme-classifier"
CELL = "demo"
RATE_HZ = 100.0
CLASSIFIERS = 2

_LEAD_IN_S = 0.5
_FIRST_MOTION_WITHIN_S = 60.0
_SILENT_AFTER_S = 10.0
_LOOK_EVERY_S = 0.1
_ANSWER_TIMEOUT_S = 1.0
_SETTLE_S = 0.3
"""What the last operator sample causes has arrived by then."""


class Plan(NamedTuple):
    """What is to be done in a run."""

    performance: Path
    """The CSV file to play."""
    kill_at_s: float
    """After the hand began to move."""
    victim: int
    """Which classifier."""


class Played(NamedTuple):
    """What is known of a run that was seen to its end, besides the recording."""

    killed: str
    newcomer: str
    killed_ns: int
    lost_messages: int
    refused_messages: int
    cpu_cores: float
    engine: str
    """What simulated the robot."""


def play(plan: Plan, folder: Path, recording: Path, line: ProgressLine) -> Played:
    """Run the stack in `folder` until the hand has played to the end, and write the recording.

    The model is in `folder/models`, which stands for the volume of that name.

    Raises RunError where a process ends by itself or nothing moves. However this is left, every
    process it started is ended.
    """
    stack = LocalStack(
        # Whatever other stack the folder it is called in may describe.
        own_compose(),
        services=SERVICES,
        scale={CLASSIFIER: CLASSIFIERS},
        router="tcp/127.0.0.1:0",
        folder=folder,
        environment={"input-device": _input_settings(plan)},
        variables={**os.environ, "HMCS_CELL": CELL},
    )
    with stack, _observer(stack, recording) as observer:
        line.say(f"{len(stack.processes)} processes and a router at {stack.router} come up")
        with open_observer(stack.router, CELL) as bus:
            played = _Run(stack, observer, bus, line).to_the_end(plan)
        observer.stop()
    return played


class _Run:
    def __init__(
        self, stack: LocalStack, observer: StackProcess, bus: Bus, line: ProgressLine
    ) -> None:
        self._stack = stack
        self._observer = observer
        self._bus = bus
        self._line = line
        self._told_s = time.monotonic()

    def to_the_end(self, plan: Plan) -> Played:
        self._until(0.0, _FIRST_MOTION_WITHIN_S)
        self._line.say("the hand moves")
        meter = CpuMeter(self._stack.processes.values())
        self._until(plan.kill_at_s, _SILENT_AFTER_S)
        before = _healths(self._bus)
        victim = self._stack.instance(CLASSIFIER, plan.victim)
        meter.note_end(victim)
        killed_ns = time.monotonic_ns()
        self._stack.kill(CLASSIFIER, plan.victim)
        newcomer = self._stack.start(CLASSIFIER)
        self._line.say(f"{victim.instance} is killed, {newcomer.instance} takes its place")
        self._until(float("inf"), _SILENT_AFTER_S)
        self._check(_SILENT_AFTER_S)
        cores = meter.cores(self._stack.processes.values())
        self._bus.pump(_SETTLE_S)
        (engine,) = (s.facts["engine"] for s in look(self._bus) if s.member.service == ROBOT)
        # Instances are named once: the newcomer does not stand in for the one that was killed.
        healths = {**before, **_healths(self._bus)}.values()
        return Played(
            killed=victim.instance,
            newcomer=newcomer.instance,
            killed_ns=killed_ns,
            lost_messages=sum(sum(health.lost.values()) for health in healths),
            refused_messages=sum(sum(health.refused.values()) for health in healths),
            cpu_cores=cores,
            engine=engine,
        )

    def _until(self, moving_s: float, patience_s: float) -> None:
        """Look on until the hand has moved for so long, or has finished."""
        self._told_s = time.monotonic()
        while True:
            for progress in self._news():
                self._line.show(progress)
                if progress.phase == "finished":
                    return
                if progress.phase == "moving":
                    self._told_s = time.monotonic()
                    if progress.moving_s >= moving_s:
                        return
            self._check(patience_s)
            time.sleep(_LOOK_EVERY_S)

    def _news(self) -> Iterator[Progress]:
        for text in self._observer.new_lines():
            event = json.loads(text) if text.startswith("{") else {}
            if event.get("event") == PROGRESS:
                yield Progress(**{name: event[name] for name in Progress._fields})

    def _check(self, patience_s: float) -> None:
        for process in (*self._stack.processes.values(), self._observer):
            if not process.running and not process.stopping:
                last = "\n".join(f"  {text}" for text in process.last_lines())
                raise RunError(f"{process.instance} ended by itself:\n{last}")
        if time.monotonic() - self._told_s > patience_s:
            ill = [f"{s.member.instance}: {_doing(s)}" for s in look(self._bus)]
            raise RunError(f"nothing moved for {patience_s:g} s:\n  " + "\n  ".join(ill))


@contextmanager
def _observer(stack: LocalStack, recording: Path) -> Iterator[StackProcess]:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("HMCS_")}
    process = StackProcess(
        Observer.name,
        "observer",
        (
            *(sys.executable, "-m", "hmcs_demo.observer", "--instance", "observer"),
            *("--router", stack.router, "--cell", CELL, "--output", str(recording)),
        ),
        {"OMP_NUM_THREADS": "1", **environment},
        stack.folder / "logs" / "observer.log",
        stop_grace_s=10.0,
    )
    try:
        yield process
    finally:
        process.kill()


def _input_settings(plan: Plan) -> dict[str, str]:
    waited_for = [
        *["gesteme_classifier"] * CLASSIFIERS,
        *("task_hmm", "fixture_controller", "robot", Observer.name),
    ]
    return {
        "HMCS_SOURCE": "recorded",
        "HMCS_DEMONSTRATION": str(plan.performance),
        "HMCS_RATE_HZ": f"{RATE_HZ:g}",
        "HMCS_REPEAT": "1",
        "HMCS_LEAD_IN_S": f"{_LEAD_IN_S:g}",
        "HMCS_RE_ENGAGE": "true",
        "HMCS_WAIT_FOR": json.dumps(waited_for),
    }


def _healths(bus: Bus) -> dict[str, Health]:
    """How every process is, by instance."""
    answers = HEALTH.ask(bus, Ask(), timeout_s=_ANSWER_TIMEOUT_S)
    return {answer.envelope.source.instance: answer.body for answer in answers}


def _doing(sighting: Sighting) -> str:
    return sighting.health.detail if sighting.health else "present, but does not answer"
