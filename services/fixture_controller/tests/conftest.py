"""A router, model files, and a fixture controller in this thread with somebody at its controls."""

from __future__ import annotations

import logging
import socket
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import (
    Belief,
    Command,
    FixtureState,
    Message,
    Motion,
    Origin,
    RobotState,
    Step,
)
from hmcs.bus.router import open_router
from hmcs.bus.session import Bus, BusSettings
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import save_model
from hmcs.task import Task
from hmcs_fixture_controller.service import FixtureController
from hmcs_fixture_controller.settings import FixtureControllerSettings
from support.made_up import line_model

DEADLINE_S = 60.0
PERIOD_S = 0.01
LOG = logging.getLogger("test")


def task(name: str) -> Task:
    return Task.model_validate(
        {
            "format": "hmcs-task/1",
            "name": name,
            "description": "one line",
            "dead_zone_m": 0.005,
            "gestemes": [{"name": "line"}],
            "states": [{"name": "only", "gestemes": ["line"], "next": {}}],
            "start": {"only": 1.0},
            "workspace": {"lower_m": [-1.0, -1.0, 0.0], "upper_m": [1.0, 1.0, 1.0]},
            "robot": {
                "model": "puma560",
                "tool_start_m": [0.6, 0.0, 0.5],
                "tool_orientation_xyzw": [0.0, 0.0, 0.0, 1.0],
            },
            # The hand of these tests goes across the path all the time.
            "fixture": {"compliance": "belief", "maximum_factor": 0.8, "tremor": "none"},
        }
    )


def model(name: str, length_m: float, of_task: str = "one-line") -> Model:
    return line_model(name, task(of_task), np.array([[0.0, 0, 0], [length_m, 0, 0]]))


@pytest.fixture
def make_model(tmp_path: Path) -> Callable[..., Path]:
    """Write a model file whose one gesteme is a line along x."""

    def make(
        name: str = "lines",
        length_m: float = 0.5,
        folder: str = "models",
        of_task: str = "one-line",
    ) -> Path:
        path = tmp_path / folder / f"{name}.hmcs"
        save_model(model(name, length_m, of_task), path)
        return path

    return make


@pytest.fixture(scope="session")
def router() -> Iterator[str]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with open_router(endpoint):
        yield endpoint


class Device:
    """An input device and the recognizers behind it."""

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.motions = bus.publisher(Motion, bus.keys.motion)
        self.steps = bus.publisher(Step, bus.keys.step)
        self.beliefs = {
            recognizer: bus.publisher(Belief, bus.keys.belief(recognizer))
            for recognizer in ("lines", "mine")
        }
        self.position = np.zeros(3)
        self.step = 0

    def move(self, dead_man: bool = True, velocity: tuple[float, ...] = (0.1, 0.1, 0.0)) -> int:
        """Publish a sample; return its number."""
        self.position = self.position + np.array(velocity) * PERIOD_S
        return self.motions.put(
            Motion(position=self.position, velocity=np.array(velocity), dead_man=dead_man),
            self.origin(captured_ns=len(velocity)),
        ).seq

    def origin(self, captured_ns: int = 7, seq: int = 0) -> Origin:
        return Origin(boot=self.bus.source.boot, seq=seq, captured_ns=captured_ns)

    def make_step(self, seq: int) -> None:
        displacement = np.array([0.001, 0.001, 0.0])
        self.steps.put(
            Step(
                index=self.step,
                position=self.step * displacement,
                displacement=displacement,
            ),
            self.origin(seq=seq),
        )
        self.step += 1

    def believe(self, model_hash: str, *, recognizer: str = "lines", **fields: Any) -> None:
        self.beliefs[recognizer].put(self.belief(model_hash, **fields))

    def belief(self, model_hash: str, **fields: Any) -> Belief:
        said: dict[str, Any] = {
            "model_hash": model_hash,
            "clock": self.bus.source.boot,
            "step": self.step - 1,
            "states": ("only",),
            "probabilities": np.array([1.0]),
            "unknown": 0.0,
            "likely_gesteme": "line",
            "segment_start": 0,
            "log_likelihood": 0.0,
            "mean_log_likelihood": 0.0,
            "unknown_alarm": False,
            "missing_gestemes": (),
        }
        return Belief(**(said | fields))


class Cell:
    """A fixture controller with an operator, a recognizer and a robot, all in this thread."""

    def __init__(self, router: str, stack: ExitStack, **settings: Any) -> None:
        self._router, self._stack = router, stack
        self.robot = self.open_bus("robot")
        self.commands: list[tuple[Command, Origin | None]] = []
        self.states: list[FixtureState] = []
        self.robot.subscribe(
            Command,
            self.robot.keys.command,
            lambda got: self.commands.append((got.body, got.envelope.origin)),
        )
        self.robot.subscribe(
            FixtureState, self.robot.keys.fixture_state, lambda got: self.states.append(got.body)
        )
        self.robot_states = self.robot.publisher(RobotState, self.robot.keys.robot_state)
        self.device = Device(self.open_bus("input_device"))
        self.bus = self.open_bus("fixture_controller")
        # A busy machine may hold this thread up for longer than an operator may be silent.
        patient = {"input_stale_after_ms": 1000, "belief_stale_after_ms": 1000}
        self.service = FixtureController(
            FixtureControllerSettings(router=router, **(patient | settings)), self.bus, LOG
        )
        self.service.start()
        self.until(lambda: self.commands, "the first command")

    def open_bus(self, service: str) -> Bus:
        settings = BusSettings(router=self._router, connect_timeout_s=DEADLINE_S)
        return self._stack.enter_context(Bus.open(settings, service, "x", log=LOG))

    def until(self, condition: Callable[[], object], what: str) -> None:
        """Pump everybody until the condition holds; fail naming `what` after the deadline."""
        deadline_s = time.monotonic() + DEADLINE_S
        while not condition():
            assert time.monotonic() < deadline_s, f"waited in vain for {what}"
            self.bus.pump(0.001)
            self.robot.pump(0.001)

    def drive(self, dead_man: bool = True) -> tuple[Command, Origin | None]:
        """Move the hand once; return the command it led to."""
        before = self.bus.counters.received["motion"]
        self.device.move(dead_man)
        self.until(lambda: self.bus.counters.received["motion"] > before, "a sample")
        sent = self.bus.counters.sent["command"]
        self.until(lambda: self.robot.counters.received["command"] >= sent, "a command")
        self.until(lambda: len(self.states) >= sent, "a state")
        return self.commands[-1]

    def guide(self, model_hash: str, *, recognizer: str = "lines", **fields: Any) -> FixtureState:
        """Move the hand with a step and a belief; return the state after it."""
        before = dict(self.bus.counters.received)
        self.device.make_step(self.device.move())
        self.device.believe(recognizer=recognizer, **({"model_hash": model_hash} | fields))

        def all_came() -> bool:
            names = ("motion", "step", "belief")
            return all(self.bus.counters.received[name] > before.get(name, 0) for name in names)

        self.until(all_came, "sample, step and belief")
        self.drive()
        return self.states[-1]

    def guide_until_stiff(self, model_hash: str) -> FixtureState:
        """Move the hand, surely believed in, until the fixture is as stiff as it gets."""
        self.until(lambda: self.guide(model_hash).factor > 0.8 - 1e-9, "a stiff fixture")
        return self.states[-1]

    def ask(self, verb: str, question: Message, answer_type: type[Message]) -> Any:
        """Ask the service over the bus; return its answer, or the refusal as an exception."""
        key = self.bus.keys.rpc("fixture_controller", "x", verb)
        with ThreadPoolExecutor(1) as pool:
            asked = pool.submit(self.robot.ask, key, question, answer_type, DEADLINE_S)
            deadline_s = time.monotonic() + DEADLINE_S
            while not asked.done() and time.monotonic() < deadline_s:
                self.bus.pump(0.001)
        if asked.exception() is not None:
            return asked.exception()
        return asked.result()[0].body

    def engage(self) -> None:
        """Release the dead-man and press it, until the operator drives."""
        self.until(lambda: self.drive(False) and self.drive()[0].engaged, "an engaged operator")


@pytest.fixture
def make_cell(router: str) -> Iterator[Callable[..., Cell]]:
    """Bring up a fixture controller with these settings and whoever it talks to."""
    with ExitStack() as stack:
        yield lambda **settings: Cell(router, stack, **settings)
