"""A router, a model file, and a console in this thread with somebody else on the bus."""

from __future__ import annotations

import logging
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import Handle, Label, Message, Origin, RobotState
from hmcs.bus.router import open_router
from hmcs.bus.session import Bus, BusSettings
from hmcs.recognition.model import Model
from hmcs.recognition.model_file import save_model
from hmcs.task import Task
from hmcs_console.service import Console
from hmcs_console.serving.gateway import Served
from hmcs_console.settings import ConsoleSettings
from support.doors import Behind, Door
from support.made_up import line_model

DEADLINE_S = 60.0
LOG = logging.getLogger("test")


def task() -> Task:
    return Task.model_validate(
        {
            "format": "hmcs-task/1",
            "name": "made-up",
            "dead_zone_m": 0.005,
            "gestemes": [{"name": "line"}],
            "states": [
                {"name": "free", "gestemes": ["line"], "next": ["in"]},
                {
                    "name": "in",
                    "gestemes": ["line"],
                    "next": {},
                    "fixture": {
                        "volume": {
                            "knots": [
                                {"progress": 0.0, "radius_m": 0.05},
                                {"progress": 1.0, "radius_m": 0.01},
                            ]
                        }
                    },
                },
            ],
            "start": {"free": 1.0},
            "workspace": {
                "lower_m": [-1.0, -1.0, 0.0],
                "upper_m": [1.0, 1.0, 1.0],
                "obstacles": [
                    {"name": "a", "shape": "box", "position_m": [0, 0, 0.1], "size_m": [1, 1, 1]},
                    {"name": "b", "shape": "sphere", "position_m": [0, 0, 0.1], "radius_m": 0.1},
                    {
                        "name": "c",
                        "shape": "cylinder",
                        "position_m": [0, 0, 0.1],
                        "radius_m": 0.1,
                        "length_m": 0.3,
                    },
                ],
                "forbidden": [
                    {"name": "d", "shape": "plane", "position_m": [0, 0, 0], "normal": [0, 0, 1]},
                    {"name": "e", "shape": "box", "position_m": [0, 0, 0.1], "size_m": [1, 1, 1]},
                    {"name": "f", "shape": "sphere", "position_m": [0, 0, 0.1], "radius_m": 0.1},
                    {
                        "name": "g",
                        "shape": "capsule",
                        "position_m": [0, 0, 0.1],
                        "end_m": [0.3, 0, 0.1],
                        "radius_m": 0.1,
                    },
                    {"name": "h", "shape": "mesh", "position_m": [0, 0, 0], "file": "nowhere.stl"},
                ],
            },
            "robot": {
                "model": "puma560",
                "tool_start_m": [0.6, 0.0, 0.5],
                "tool_orientation_xyzw": [0.0, 0.0, 0.0, 1.0],
            },
        }
    )


def model() -> Model:
    return line_model("lines", task(), np.array([[0.0, 0, 0], [0.25, 0, 0], [0.5, 0, 0]]))


@pytest.fixture
def model_file(tmp_path: Path) -> Path:
    path = tmp_path / "models" / "lines.hmcs"
    save_model(model(), path)
    return path


@pytest.fixture(scope="session")
def router() -> Iterator[str]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with open_router(endpoint):
        yield endpoint


class Cell:
    """A console, and one other process that hears it and answers it."""

    def __init__(self, router: str, stack: ExitStack, **settings: Any) -> None:
        self._router, self._stack = router, stack
        self.other = self.open_bus("recorder")
        self.handles: list[tuple[float, Handle]] = []
        self.labels: list[Label] = []
        self.other.subscribe(
            Handle,
            self.other.keys.handle,
            lambda got: self.handles.append((time.monotonic(), got.body)),
        )
        self.other.subscribe(Label, self.other.keys.label, lambda got: self.labels.append(got.body))
        self.robot_states = self.other.publisher(RobotState, self.other.keys.robot_state)
        self.bus = self.open_bus("console")
        self.service = Console(
            ConsoleSettings(router=router, **({"port": 0} | settings)), self.bus, LOG
        )
        self._end = stack.enter_context(ExitStack())
        self._end.callback(self.service.close)
        self.service.start()
        # The match of any publisher on its key shows a discovered subscriber.
        probes = (
            self.bus.publisher(Handle, self.bus.keys.handle),
            self.bus.publisher(Label, self.bus.keys.label),
            self.robot_states,
        )
        self.until(lambda: all(probe.matching for probe in probes), "each other")

    def close(self) -> None:
        """End the console; a second time does nothing."""
        self._end.close()

    def open_bus(self, service: str, instance: str = "x") -> Bus:
        settings = BusSettings(router=self._router, connect_timeout_s=DEADLINE_S)
        return self._stack.enter_context(Bus.open(settings, service, instance, log=LOG))

    def until(self, condition: Callable[[], object], what: str) -> None:
        """Pump everybody until the condition holds; fail naming `what` after the deadline."""
        deadline_s = time.monotonic() + DEADLINE_S
        while not condition():
            assert time.monotonic() < deadline_s, f"waited in vain for {what}"
            self.bus.pump(0.001)
            self.other.pump(0.001)

    def wait(self, seconds: float) -> None:
        """Pump everybody for so long."""
        end_s = time.monotonic() + seconds
        self.until(lambda: time.monotonic() >= end_s, "time to go by")

    def move_robot(self, x_m: float, origin: Origin | None = None) -> None:
        """Publish where the robot is."""
        still = np.zeros(6)
        self.robot_states.put(
            RobotState(
                robot="puma560",
                joint_positions=np.zeros(6),
                joint_velocities=np.zeros(6),
                tool_position=np.array([x_m, 0.0, 0.5]),
                tool_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
                tool_twist=still,
                reference_twist=still,
                nearest_obstacle="",
                nearest_distance_m=None,
                contacts=(),
                stop="none",
                limited=(),
            ),
            origin,
        )


@pytest.fixture
def make_cell(router: str) -> Iterator[Callable[..., Cell]]:
    """Bring up a console with these settings and whoever it talks to."""
    with ExitStack() as stack:
        yield lambda **settings: Cell(router, stack, **settings)


class Process:
    """Somebody who answers questions, on a thread of its own, as another process would be."""

    def __init__(
        self,
        cell: Cell,
        service: str,
        instance: str,
        answers: Mapping[str, tuple[type[Any], Callable[[Any], Message]]],
    ) -> None:
        """Be there, and answer by verb: the type of a question, and who answers it."""
        self.bus = cell.open_bus(service, instance)
        self.ending = threading.Event()
        for verb, (question, answer) in answers.items():
            self.bus.answer(verb, question, answer)
        self.bus.announce(self.bus.keys.presence(service, instance))
        self._thread = threading.Thread(target=self._live)
        self._thread.start()

    def close(self) -> None:
        """End."""
        self.ending.set()
        self._thread.join()

    def _live(self) -> None:
        while not self.ending.is_set():
            self.bus.pump(0.005)


@pytest.fixture
def make_process(make_cell: Callable[..., Cell]) -> Iterator[Callable[..., Process]]:
    """Bring up somebody a console talks to."""
    del make_cell  # Ends after whoever is on its buses.
    with ExitStack() as stack:

        def make(*arguments: Any) -> Process:
            process = Process(*arguments)
            stack.callback(process.close)
            return process

        yield make


@pytest.fixture
def behind() -> Iterator[Behind]:
    made = Behind()
    yield made
    made.close()


@pytest.fixture
def make_door(behind: Behind) -> Iterator[Callable[..., Door]]:
    with ExitStack() as stack:

        def make(reports: Callable[[str], bytes | None] = lambda _: None, **settings: Any) -> Door:
            door = Door(
                behind,
                reports=reports,
                served=Served(**({"host": "127.0.0.1", "port": 0} | settings)),
            )
            stack.callback(door.gateway.close)
            return door

        yield make
