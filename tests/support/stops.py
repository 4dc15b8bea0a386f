"""Stale commands: a process of the fast loop is killed or hangs while the robot moves."""

from __future__ import annotations

import signal
import time
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from hmcs.bus.messages import RobotState
from hmcs.bus.session import Received
from hmcs.motion.demonstrations import Demonstration, write_csv
from hmcs_local.processes import StackProcess
from support.hand import Watcher
from support.stack import Stack

Victim = Literal["input_device", "fixture_controller"]
How = Literal["killed", "hung"]
KINDS: tuple[tuple[Victim, How], ...] = (
    ("input_device", "killed"),
    ("input_device", "hung"),
    ("fixture_controller", "killed"),
    ("fixture_controller", "hung"),
)

COMMANDED_ZERO_WITHIN_S = 0.120
STANDS_WITHIN_S = 0.250
STANDING_M_S = 0.002
MOVING_M_S = 0.05

_WATCHED_S = 0.45
"""How long the robot is looked at after the fault."""
_CIRCLE_M, _PASS_S, _LEAD_IN_S = 0.03, 1.2, 0.35
_PASSES = 10
"""After so many presses of the dead-man without motion there will be none."""
_NS = 1e-9


class Trial(NamedTuple):
    """One fault and what the robot did, times in s from the fault to the state that shows it."""

    victim: Victim
    how: How
    speed_m_s: float
    """Of the tool when it happened."""
    commanded_zero_s: float
    """From here on the reference was zero."""
    standing_s: float
    """From here on the tool stood."""
    resumed: str
    """How motion came back: `re-engaged`, or what was wrong about it."""

    @property
    def good(self) -> bool:
        """Whether the robot did what it must."""
        return self.good_within(1.0)

    def good_within(self, times: float) -> bool:
        """Whether it did, in so many times the time it has.

        A state comes late to whoever looks on a machine that has other work.
        """
        return (
            self.commanded_zero_s <= times * COMMANDED_ZERO_WITHIN_S
            and self.standing_s <= times * STANDS_WITHIN_S
            and self.resumed == "re-engaged"
        )


def circles(folder: Path) -> Path:
    """Write a demonstration that goes round in a circle at a steady 0.16 m/s."""
    time_s = np.linspace(0.0, _PASS_S, 121)
    angle = 2.0 * np.pi * time_s / _PASS_S
    positions = np.stack(
        [0.6 + 0.0 * angle, _CIRCLE_M * np.cos(angle), 0.5 + _CIRCLE_M * np.sin(angle)], axis=1
    )
    path = folder / "circle.csv"
    write_csv(path, Demonstration("circle", time_s, positions, (None,) * len(time_s)))
    return path


class FastLoop:
    """Input device, fixture controller and robot, driven round and round; faults on demand."""

    def __init__(self, stack: Stack, folder: Path, rng: np.random.Generator) -> None:
        self.stack = stack
        self._rng = rng
        self._path = circles(folder)
        bus = stack.open_bus("observer", "o")
        stack.watch(bus)
        self.watcher = Watcher(bus)
        self.robot = stack.start("robot", "robot")
        self.fixture = stack.start("fixture_controller", "fixture_controller")
        self.input = self._start_input()
        stack.until_ready(self.robot, self.fixture, self.input)

    def trial(self, victim: Victim, how: How) -> Trial:
        """Let the fault happen while the robot moves, see it stand, mend it, see it move again."""
        self.until_moving()
        speed = _speed(self.watcher.robot[-1])
        fault_ns = time.monotonic_ns()
        process = self.input if victim == "input_device" else self.fixture
        process.send(signal.SIGKILL if how == "killed" else signal.SIGSTOP)
        self.stack.elapse(_WATCHED_S)
        seen = [r for r in self.watcher.robot if r.received_ns > fault_ns]
        commanded_s = _since(seen, fault_ns, lambda r: bool(np.any(r.body.reference_twist)))
        standing_s = _since(seen, fault_ns, lambda r: _speed(r) >= STANDING_M_S)
        mended_ns = time.monotonic_ns()
        self._mend(process, how)
        resumed = self._resumed(fault_ns + round(STANDS_WITHIN_S / _NS), mended_ns)
        return Trial(victim, how, speed, commanded_s, standing_s, resumed)

    def until_moving(self) -> None:
        """Wait until the robot has moved for a moment, with time left before the pass ends."""
        assert any(self._moves_in_next_pass() for _ in range(_PASSES)), "the robot does not move"
        watcher = self.watcher
        del watcher.robot[:-1], watcher.motions[:-1], watcher.commands[:-1], watcher.fixture[:-1]

    def _moves_in_next_pass(self) -> bool:
        """Wait for the next press of the dead-man; tell whether motion soon came of it.

        It does not where the press came before the samples before it had counted as fresh.
        """
        watcher = self.watcher
        self.stack.until(lambda: watcher.motions and not watcher.motions[-1].body.dead_man)
        self.stack.until(lambda: watcher.motions[-1].body.dead_man)
        began_s = time.monotonic()
        self.stack.elapse(self._rng.uniform(0.15, _PASS_S - _WATCHED_S - 0.15))
        in_time = time.monotonic() - began_s < _PASS_S - _WATCHED_S - 0.05
        return in_time and _speed(watcher.robot[-1]) > MOVING_M_S

    def _mend(self, process: StackProcess, how: How) -> None:
        if how == "hung":
            process.send(signal.SIGCONT)
        elif process is self.input:
            self.input = self._start_input()
            self.stack.until_ready(self.input)
        else:
            self.fixture = self.stack.start("fixture_controller", "fixture_controller")
            self.stack.until_ready(self.fixture)

    def _resumed(self, stood_ns: int, mended_ns: int) -> str:
        """Wait for motion; tell whether the dead-man had been released and pressed before it."""
        watcher = self.watcher

        def moves() -> Received[RobotState] | None:
            late = (r for r in watcher.robot if r.received_ns > stood_ns)
            return next((r for r in late if np.any(r.body.reference_twist)), None)

        moved = self.stack.until(moves)
        released = [
            r.received_ns
            for r in watcher.motions
            if mended_ns < r.received_ns < moved.received_ns and not r.body.dead_man
        ]
        if not released:
            return "moved again without a re-engage"
        return "re-engaged"

    def _start_input(self) -> StackProcess:
        return self.stack.start(
            "input_device",
            "input_device",
            *("--source", "recorded", "--demonstration", self._path),
            *("--rate-hz", 100, "--repeat", 0, "--lead-in-s", _LEAD_IN_S),
        )


def _speed(received: Received[RobotState]) -> float:
    return float(np.linalg.norm(received.body.tool_twist[:3]))


def _since(seen: list[Received[RobotState]], fault_ns: int, moving: object) -> float:
    """Return the time from the fault to the state after the last one that was `moving`, s."""
    last = max((k for k, r in enumerate(seen) if moving(r)), default=-1)  # type: ignore[operator]
    if last + 1 >= len(seen):
        return float("inf")
    return (seen[last + 1].received_ns - fault_ns) * _NS
