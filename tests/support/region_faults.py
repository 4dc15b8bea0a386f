"""A tool on its way to a forbidden region, and what goes wrong with the fixture beside it."""

from __future__ import annotations

import itertools
import json
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, NamedTuple

import msgpack
import numpy as np
import yaml
import zenoh

from hmcs.bus.config import BusSettings, client_config
from hmcs.bus.messages import Command, Envelope, RobotState, Source
from hmcs.bus.session import Received
from hmcs.bus.wire import encode
from hmcs.fixtures.regions.forbidden import clearance_m
from hmcs.fixtures.regions.tool_shape import PlacedTool, tool_shape_of
from hmcs.fixtures.regions.workspace import regions_of
from hmcs.motion.demonstrations import Demonstration, write_csv
from hmcs.recognition.model_file import save_model
from hmcs.task import Task, load_task
from hmcs_local.processes import StackProcess
from support.hand import Watcher
from support.made_up import line_model
from support.stack import CELL, Stack

Shape = Literal["plane", "box", "mesh"]
SHAPES: tuple[Shape, ...] = ("plane", "box", "mesh")
How = Literal["killed", "hung", "flooded", "forged"]
WAYS: tuple[How, ...] = ("killed", "hung", "flooded", "forged")
INSIDE_M = 1e-4
"""Deeper than this is inside."""

_START_M = np.array([0.6, 0.0, 0.5])
_BELOW_M = 0.04
"""The region begins so far below the tool's start."""
_SPEED_M_S = 0.2
_WATCHED_S = 0.6
_PASSES = 20
_DOWN_S, _PASS_S = 0.4, 0.65


class Trial(NamedTuple):
    """One fault, and how near the tool came to the region, m; negative inside."""

    shape: Shape
    how: How
    distance_m: float
    """Of the tool when it happened."""
    speed_m_s: float
    nearest_m: float


def region_of(shape: Shape, folder: Path) -> dict[str, object]:
    """Return a forbidden region below the tool's start, as a task file has it."""
    top_m = float(_START_M[2]) - _BELOW_M
    if shape == "plane":
        return {"shape": "plane", "position_m": [0.6, 0.0, top_m], "normal": [0.0, 0.1, 1.0]}
    if shape == "box":
        return {
            "shape": "box", "position_m": [0.6, 0.0, top_m - 0.05], "size_m": [0.2, 0.2, 0.1],
            "orientation_xyzw": [0.0, 0.0, 0.38268343236509, 0.92387953251129],
        }  # fmt: skip
    import trimesh

    trimesh.creation.icosphere(subdivisions=4, radius=0.05).export(folder / "ball.stl")
    return {"shape": "mesh", "position_m": [0.6, 0.0, top_m - 0.05], "file": "ball.stl"}


def write_task(shape: Shape, folder: Path, tool: dict[str, object] | None = None) -> Path:
    """Write a task with such a region; return its file."""
    task: dict[str, object] = {
        "format": "hmcs-task/1",
        "name": "down",
        "dead_zone_m": 0.005,
        "gestemes": [{"name": "line"}],
        "states": [{"name": "only", "gestemes": ["line"], "next": []}],
        "start": ["only"],
        "workspace": {
            "lower_m": [0.3, -0.3, 0.2], "upper_m": [0.9, 0.3, 0.8],
            "forbidden": [{"name": "region", **region_of(shape, folder)}],
        },
        "robot": {
            "model": "puma560",
            "tool_start_m": _START_M.tolist(),
            "tool_orientation_xyzw": [0.0, 0.7071067811865476, 0.0, 0.7071067811865476],
            **({"tool": tool} if tool else {}),
        },
    }  # fmt: skip
    path = folder / f"{shape}.yaml"
    path.write_text(yaml.safe_dump(task))
    return path


def down_and_up() -> Demonstration:
    """Return a hand that goes farther down than there is room, and up again by less."""
    time_s = np.arange(0.0, _PASS_S, 0.01)
    height = np.where(
        time_s < _DOWN_S,
        -_SPEED_M_S * time_s,
        -_SPEED_M_S * _DOWN_S + _SPEED_M_S * (time_s - _DOWN_S),
    )
    way = np.stack([0 * time_s, 0 * time_s, height], axis=1)
    return Demonstration("down-and-up", time_s, way, (None,) * len(time_s))


class Descent:
    """A hand that goes down to the region over and over, with a fixture that can go wrong."""

    def __init__(
        self, stack: Stack, folder: Path, shape: Shape, random: np.random.Generator
    ) -> None:
        self.stack, self.shape = stack, shape
        self._random = random
        file = write_task(shape, folder)
        self._file = file
        self._task: Task = load_task(file)
        self._regions, self._tool = regions_of(self._task), tool_shape_of(self._task)
        self.model = folder / f"{shape}.hmcs"
        down = np.array([[0.0, 0, 0], [0, 0, -0.2]])
        save_model(line_model("down", self._task, down), self.model)
        bus = stack.open_bus("observer", "looks")
        stack.watch(bus)
        self.watcher = Watcher(bus)
        self.robot = stack.start("robot", "robot", "--task", file)
        self.fixture = self.start_fixture("fixture-0")
        self._path = folder / f"{shape}.csv"
        write_csv(self._path, down_and_up())
        stack.until_ready(self.robot, self.fixture, within_s=60.0)
        self.hand = self.start_hand("hand")
        stack.until_ready(self.hand, within_s=60.0)
        settings = BusSettings(router=stack.endpoint, cell=CELL, connect_timeout_s=15.0)
        self._stranger = zenoh.open(client_config(settings))
        self._count = 0

    def close(self) -> None:
        """Close what the stack does not."""
        self._stranger.close()  # type: ignore[no-untyped-call]

    def distance_m(self, received: Received[RobotState]) -> float:
        """Return how far the tool is from the region; negative inside."""
        state = received.body
        tool = PlacedTool(self._tool, state.tool_position, state.tool_orientation)
        return clearance_m(self._regions, tool)

    def trial(self, how: How) -> Trial:
        """Let it go wrong while the tool is near and moves down; see how near it comes."""
        wanted_m = self._random.uniform(0.001, 0.02)
        distance_m, speed_m_s = self._until_near(wanted_m)
        begin = len(self.watcher.robot)
        self._go_wrong(how)
        states = self.watcher.robot[begin - 1 :]
        nearest_m = min(map(self.distance_m, states))
        self._mend(how)
        return Trial(self.shape, how, distance_m, speed_m_s, nearest_m)

    def _until_near(self, wanted_m: float) -> tuple[float, float]:
        watcher = self.watcher
        for _ in range(_PASSES):
            for heard in (watcher.robot, watcher.motions, watcher.commands, watcher.fixture):
                del heard[:-1]
            deadline_s = time.monotonic() + 2 * _PASS_S + 2.0
            while time.monotonic() < deadline_s:
                self.stack.pump()
                if not watcher.robot:
                    continue
                distance_m = self.distance_m(watcher.robot[-1])
                speed_m_s = -float(watcher.robot[-1].body.tool_twist[2])
                if distance_m < wanted_m and speed_m_s > 0.005:
                    return distance_m, speed_m_s
            # Near it the fixture lets it go on slowly, and a machine that stalls ends many passes.
            wanted_m += 0.006
        raise AssertionError("the tool never came near the region")

    def _go_wrong(self, how: How) -> None:
        if how in ("killed", "hung", "forged"):
            self.fixture.send(signal.SIGSTOP if how == "hung" else signal.SIGKILL)
        until_s, sent = time.monotonic() + _WATCHED_S, 0
        strange = {"flooded": self._floods, "forged": self._commands}.get(how)
        flood = None if strange is None else strange()
        while time.monotonic() < until_s:
            if flood is not None:
                for _ in range(20 if how == "flooded" else 1):
                    self._stranger.put(*next(flood))
                    sent += 1
            self.stack.pump()

    def _floods(self) -> Iterator[tuple[str, bytes]]:
        """What keeps a fixture controller busy: every kind of message it hears, and no sense."""
        keys = self.stack._buses[0].keys
        crowd = msgpack.packb({"schema": "motion/1", "x": [None] * 1500})
        while True:
            for key in (keys.motion, keys.step, keys.belief("down", "x"), keys.robot_state):
                yield key, crowd

    def _commands(self) -> Iterator[tuple[str, bytes]]:
        """A stranger who drives the robot into the region as fast as it goes."""
        key = self.stack._buses[0].keys.command
        source = Source(service="stranger", instance="x", boot=f"stranger-{self._count}")
        self._count += 1
        for number in range(10**9):
            twist = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
            command = Command(twist=twist, valid_for_ns=1_000_000_000, engaged=number > 15)
            yield key, encode(command, Envelope(source=source, seq=number))

    def _mend(self, how: How) -> None:
        if how == "hung":
            self.fixture.send(signal.SIGCONT)
        elif how != "flooded":
            self._count += 1
            self.fixture = self.start_fixture(f"fixture-{self._count}")
            self.stack.until_ready(self.fixture, within_s=60.0)

    def start_fixture(self, instance: str) -> StackProcess:
        """Start a fixture controller for the region."""
        return self.stack.start(
            "fixture_controller", instance, "--models", json.dumps([str(self.model)])
        )

    def start_hand(self, instance: str) -> StackProcess:
        """Start the hand that goes down and up, over and over, and takes hold again by itself."""
        return self.stack.start(
            "input_device", instance, "--task", self._file, "--source", "recorded",
            "--demonstration", self._path, "--lead-in-s", 0.5, "--repeat", 0, "--re-engage",
        )  # fmt: skip

    def flood(self, messages: int) -> None:
        """Send so many messages without sense at once."""
        for what in itertools.islice(self._floods(), messages):
            self._stranger.put(*what)
