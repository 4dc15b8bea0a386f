"""The robot on a bus of its own, pumped beside a writer in one thread."""

from __future__ import annotations

import itertools
import logging
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import psutil
import pytest

from hmcs.bus.config import BusSettings
from hmcs.bus.keys import ANY
from hmcs.bus.messages import (
    Ask,
    Command,
    Done,
    Origin,
    Pairing,
    RobotState,
    StopRequest,
)
from hmcs.bus.router import open_router
from hmcs.bus.service import CannotGoOnError
from hmcs.bus.session import Bus, Publisher, Received
from hmcs_robot.engine import PREFERRED
from hmcs_robot.service import Robot
from hmcs_robot.settings import RobotSettings

DEADLINE_S = 60.0
VALID_FOR_S = 1.0
"""So long a busy machine may keep a command; it is the longest there is."""
TASK = """
format: hmcs-task/1
name: push
dead_zone_m: 0.01
gestemes: [{name: go}]
states: [{name: going, gestemes: [go], next: []}]
start: [going]
workspace:
  lower_m: [0.4, -0.3, 0.2]
  upper_m: [0.8, 0.3, 0.8]
  obstacles:
    - {name: wall, shape: box, position_m: [0.6, 0.13, 0.5], size_m: [0.3, 0.1, 0.3]}
robot:
  model: puma560
  tool_start_m: [0.6, 0.0, 0.5]
  tool_orientation_xyzw: [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]
"""


class Cell:
    """A robot, what it says, and writers of commands."""

    def __init__(self, router: str, task: Path, hang_s: float = 5.0, engine: str = "auto") -> None:
        self.settings = BusSettings(router=router)
        self.engine = engine
        self.buses: list[Bus] = []
        self.bus = self.open("robot")
        settings = RobotSettings(
            router=router,
            task=str(task),
            engine=engine,
            # Patient, so that a busy machine is not taken for a hang or a late command.
            hang_s=hang_s,
            late_tick_s=5.0,
            command_valid_for_ms=VALID_FOR_S * 1000,
            realtime_priority=0,
        )
        self.robot = Robot(settings, self.bus, logging.getLogger("robot"))
        self.robot.start()
        self.said: list[RobotState] = []
        self.origins: list[Origin | None] = []
        self.writers: dict[str, Publisher[Command]] = {}
        observer = self.open("observer")
        observer.subscribe(RobotState, observer.keys.robot_state, self._hear)

    def open(self, service: str) -> Bus:
        self.buses.append(Bus.open(self.settings, service, "test"))
        return self.buses[-1]

    def writer(self, name: str) -> Publisher[Command]:
        if name not in self.writers:
            bus = self.open(name)
            self.writers[name] = bus.publisher(Command, bus.keys.command)
        return self.writers[name]

    def say(self, engaged: bool, y_m_s: float = 0.0, writer: str = "fixture") -> None:
        twist = np.array([0.0, y_m_s, 0, 0, 0, 0])
        self.writer(writer).put(
            Command(twist=twist, valid_for_ns=round(VALID_FOR_S * 1e9), engaged=engaged),
            Origin(boot="hand", seq=7, captured_ns=1),
        )

    def until(
        self, true: Callable[[RobotState], bool], say: Callable[[], None] | None = None
    ) -> RobotState:
        """Pump until a state is as wished, and return it; meanwhile `say` about every 10 ms."""
        began = time.monotonic()
        self.said.clear()
        while time.monotonic() - began < DEADLINE_S:
            if say:
                say()
            for bus in self.buses:
                bus.pump(0.002)
            if self.said and true(self.said[-1]):
                return self.said[-1]
        raise AssertionError(f"never came true; at last: {self.said[-1] if self.said else None}")

    def engage(self, y_m_s: float = 0.0, writer: str = "fixture") -> None:
        self.until(lambda s: s.stop == "disengaged", lambda: self.say(False, writer=writer))
        self.until(lambda s: s.stop == "none", lambda: self.say(True, y_m_s, writer))

    def drive(self, y_m_s: float, true: Callable[[RobotState], bool]) -> RobotState:
        """Command a velocity until a state is as wished, and return it; engage where need be."""

        def command() -> None:
            late = bool(self.said) and self.said[-1].stop == "stale_command"
            self.say(not late, y_m_s)

        self.engage(y_m_s)
        return self.until(true, command)

    def _hear(self, received: Received[RobotState]) -> None:
        self.said.append(received.body)
        self.origins.append(received.envelope.origin)

    def close(self) -> None:
        self.robot.close()
        for bus in self.buses:
            bus.close()


def _needs(engine: str) -> tuple[pytest.MarkDecorator, ...]:
    no_wheels = engine == "pybullet" and sys.version_info >= (3, 12)
    return (pytest.mark.skipif(no_wheels, reason="PyBullet has no wheels for this Python"),)


on_both_engines = pytest.mark.parametrize(
    "cell",
    [pytest.param({"engine": name}, id=name, marks=_needs(name)) for name in PREFERRED],
    indirect=True,
)


@pytest.fixture
def router() -> Iterator[str]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    with open_router(endpoint):
        yield endpoint


@pytest.fixture
def task(tmp_path: Path) -> Path:
    path = tmp_path / "push.yaml"
    path.write_text(TASK)
    return path


@pytest.fixture
def cell(router: str, task: Path, request: pytest.FixtureRequest) -> Iterator[Cell]:
    made = Cell(router, task, **getattr(request, "param", {}))
    yield made
    made.close()


@on_both_engines
def test_the_tool_follows_the_command_and_the_state_carries_its_origin(cell: Cell) -> None:
    begun = cell.until(lambda _: True)
    assert begun.stop == "no_command"
    assert begun.robot == "puma560"
    assert begun.tool_position == pytest.approx([0.6, 0.0, 0.5], abs=1e-4)
    assert begun.nearest_obstacle == "wall"
    assert begun.joint_names[0] == "waist"
    assert len(begun.joint_names) == len(begun.joint_positions) == 6
    cell.drive(-0.1, lambda s: s.stop == "none" and s.tool_position[1] < -0.03)
    moving = cell.said[-1]
    assert moving.tool_twist[:3] == pytest.approx([0, -0.1, 0], abs=0.005)
    assert moving.reference_twist == pytest.approx([0, -0.1, 0, 0, 0, 0], abs=1e-6)
    assert cell.origins[-1] == Origin(boot="hand", seq=7, captured_ns=1)
    assert cell.robot.health() == (True, "following commands")
    assert cell.robot.facts()["engine"] == cell.engine


@pytest.mark.long
def test_silence_makes_it_stand_until_it_is_engaged_anew(cell: Cell) -> None:
    cell.engage(-0.1)
    cell.until(lambda s: s.stop == "stale_command")
    cell.until(lambda s: not s.reference_twist.any())
    cell.until(lambda s: np.abs(s.joint_velocities).max() < 1e-3)
    for _ in range(20):
        cell.until(lambda _: True, lambda: cell.say(True, -0.1))
    assert cell.said[-1].stop == "stale_command"
    assert cell.origins[-1] is None
    cell.engage(-0.1)


def test_a_second_writer_is_refused_and_counted(cell: Cell) -> None:
    cell.writer("intruder")
    cell.engage(-0.05)

    turns = itertools.cycle((("fixture", True), ("intruder", False)))

    def in_turns() -> None:
        writer, engaged = next(turns)
        cell.say(engaged, -0.05, writer)

    cell.until(lambda s: s.tool_position[1] < -0.02, in_turns)
    assert cell.bus.counters.refused["command"] > 0
    assert all(state.stop == "none" for state in cell.said)


@pytest.mark.long
def test_it_stops_when_asked_and_follows_again_after_a_new_engage(cell: Cell) -> None:
    cell.engage(-0.1)
    asker = cell.open("asker")
    key = asker.keys.rpc("robot", ANY, "stop")
    with ThreadPoolExecutor(1) as beside:
        answers = beside.submit(asker.ask, key, Ask(), Done, DEADLINE_S)
        cell.until(lambda s: s.stop == "asked", lambda: cell.say(True, -0.1))
    assert "takes hold again" in answers.result()[0].body.detail
    cell.until(lambda s: np.abs(s.joint_velocities).max() < 1e-3, lambda: cell.say(True, -0.1))
    assert cell.said[-1].stop == "asked"
    cell.engage(-0.1)


@on_both_engines
def test_a_collision_stops_it_and_it_can_be_driven_away(cell: Cell) -> None:
    hit = cell.drive(0.2, lambda s: s.stop == "collision")
    assert hit.contacts == ("wall",)
    cell.until(lambda s: np.abs(s.joint_velocities).max() < 1e-3, lambda: cell.say(True, 0.2))
    assert cell.said[-1].stop == "collision"
    away = cell.drive(-0.1, lambda s: s.tool_position[1] < 0.0)
    assert away.contacts == ()


@pytest.mark.long
def test_what_is_no_command_is_refused_and_reported_as_the_reason(cell: Cell) -> None:
    bus = cell.open("broken")
    raw = bus._session.declare_publisher(bus.keys.command)
    cell.engage(-0.05)
    state = cell.until(lambda s: s.stop != "none", lambda: raw.put(b"\xc1 no msgpack"))
    assert state.stop == "refused_command"


@pytest.mark.parametrize("cell", [{"hang_s": 0.25}], indirect=True)
def test_a_hang_of_the_wire_room_stops_it_and_what_queued_up_moves_nothing(cell: Cell) -> None:
    cell.engage(-0.05)
    began = time.monotonic()
    while time.monotonic() - began < 0.3:
        cell.say(True, -0.05)
        for bus in cell.buses[1:]:
            bus.pump(0.005)
    cell.until(lambda s: s.stop == "stale_command", lambda: cell.say(True, -0.05))
    cell.until(lambda _: cell.bus.counters.late["command"] > 0, lambda: cell.say(True, -0.05))


def test_a_published_stop_needs_no_answer_and_holds(cell: Cell) -> None:
    cell.engage(-0.1)
    watcher = cell.open("operator")
    stops = watcher.publisher(StopRequest, watcher.keys.stop_request)
    stops.put(StopRequest(reason="the test wants it"))
    cell.until(lambda s: s.stop == "asked", lambda: cell.say(True, -0.1))
    for _ in range(20):
        cell.until(lambda _: True, lambda: cell.say(True, -0.1))
    assert cell.said[-1].stop == "asked"


def test_a_fixture_that_drives_another_robot_moves_nothing_here(cell: Cell) -> None:
    cell.engage(-0.1)
    bus = next(bus for bus in cell.buses if bus.source.service == "fixture")
    pairings = bus.publisher(Pairing, bus.keys.pairing)

    def elsewhere() -> None:
        paired = Pairing(device="", device_instance="", robot="other", robot_instance="other")
        pairings.put(paired)
        cell.say(True, -0.1)

    cell.until(lambda s: s.stop == "not_paired", elsewhere)
    assert cell.bus.counters.refused["command"] > 0
    assert cell.robot.health()[1].startswith("standing: not_paired")


def test_a_control_process_that_ends_is_reported_and_ends_the_robot(cell: Cell) -> None:
    cell.until(lambda _: True)
    cell.robot._room._process.kill()

    def ended() -> bool:
        try:
            cell.bus.pump(0.01)
        except CannotGoOnError:
            return True
        return False

    began = time.monotonic()
    while not ended():
        assert time.monotonic() - began < DEADLINE_S
    assert cell.robot.health() == (False, "the control process has ended")


@pytest.mark.long
def test_a_robot_that_is_killed_leaves_no_control_process(router: str, task: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "hmcs_robot", "--router", router, "--task", str(task)]
    )
    try:
        began = time.monotonic()
        while not (children := psutil.Process(process.pid).children()):
            assert time.monotonic() - began < DEADLINE_S
        process.kill()
        gone, alive = psutil.wait_procs(children, DEADLINE_S)
        assert not alive
        assert gone
    finally:
        process.kill()
        process.wait()


@pytest.mark.long
def test_a_task_out_of_its_reach_ends_the_process_with_2_and_says_why(
    router: str, task: Path
) -> None:
    task.write_text(
        TASK.replace("tool_start_m: [0.6, 0.0, 0.5]", "tool_start_m: [2.0, 0.0, 0.5]").replace(
            "upper_m: [0.8", "upper_m: [2.8"
        )
    )
    ended = subprocess.run(
        [sys.executable, "-m", "hmcs_robot", "--router", router, "--task", str(task)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert ended.returncode == 2
    assert "robot puma560 cannot bring its tool to position (2.000, 0.000, 0.500)" in ended.stderr
    assert "Traceback" not in ended.stderr


@pytest.mark.long
def test_sigterm_ends_it_cleanly(router: str, task: Path) -> None:
    with (
        Bus.open(BusSettings(router=router), "observer", "test") as bus,
        subprocess.Popen(
            [sys.executable, "-m", "hmcs_robot", "--router", router, "--task", str(task)]
        ) as process,
    ):
        try:
            heard: list[RobotState] = []
            bus.subscribe(RobotState, bus.keys.robot_state, lambda r: heard.append(r.body))
            began = time.monotonic()
            while not heard and time.monotonic() - began < DEADLINE_S:
                bus.pump(0.05)
            assert heard
            process.send_signal(signal.SIGTERM)
            assert process.wait(timeout=30) == 0
        finally:
            process.kill()
