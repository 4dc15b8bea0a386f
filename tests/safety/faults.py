"""Random faults, one after another, on a stack that moves beside a forbidden region.

Killed, hung, flooded; the router too; busy loops, memory, descriptors, a recorder without its
folder. An outside observer looks whether the tool stays out of the region and within its speed,
whether the robot stands in time where nobody commands it, and whether all comes back by itself.
"""

from __future__ import annotations

import contextlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.progress import Progress

from bench.figures import Figure
from hmcs.bus.messages import RobotState
from hmcs.bus.session import Received
from hmcs_local.processes import StackProcess
from support.region_faults import INSIDE_M, SHAPES, Descent
from support.stack import Stack
from support.stops import COMMANDED_ZERO_WITHIN_S, STANDING_M_S, STANDS_WITHIN_S

FASTEST_M_S = 0.25 * 1.05
"""What the robot admits, and a little for what its motors do."""
MOVING_M_S = 0.02
BACK_WITHIN_S = 60.0
TRIALS_OF_A_STACK = 50
_WATCHED_S = 0.45
_BUSY = "while True: pass"
_CONNECTIONS = 300
_MEMORY_HOG = "held = bytearray(400_000_000)\nimport time\ntime.sleep(5)"


class Seen(NamedTuple):
    """What came of one fault."""

    fault: str
    violations: tuple[str, ...]
    moved_s: float
    """Oldest command, by the robot's own clock, that the reference was still not zero for."""
    coasted_s: float
    """The same for the tool that still moved."""


class World:
    """A stack with every service that has a part in motion, and faults to be done to it."""

    def __init__(self, stack: Stack, folder: Path, number: int, rng: np.random.Generator) -> None:
        self.stack, self._rng, self._folder = stack, rng, folder
        self.descent = Descent(stack, folder, SHAPES[number % len(SHAPES)], rng)
        model = self.descent.model
        self._commands: dict[str, Callable[[str], StackProcess]] = {
            "input_device": lambda name: self.descent.start_hand(name),
            "fixture_controller": lambda name: self.descent.start_fixture(name),
            "gesteme_classifier": lambda n: stack.start("gesteme_classifier", n, "--model", model),
            "task_hmm": lambda n: stack.start("task_hmm", n, "--model", model),
            "recorder": lambda n: stack.start("recorder", n, "--folder", folder / "takes"),
        }
        self._count = 0
        self.processes = {
            "input_device": self.descent.hand, "fixture_controller": self.descent.fixture
        }  # fmt: skip
        for service in ("gesteme_classifier", "task_hmm", "recorder"):
            self._start(service)
        stack.until_ready(*self.processes.values())

    def trial(self) -> Seen:
        """Let one thing go wrong while the robot moves; see what it does, and that it goes on."""
        if not self._moves():
            return Seen("none", (f"does not move within {BACK_WITHIN_S:g} s",), 0.0, 0.0)
        kinds = (self._kill, self._hang, self._router, self._load, self._disk, self._flood)
        kind = kinds[self._rng.choice(len(kinds), p=[0.25, 0.25, 0.1, 0.2, 0.05, 0.15])]
        watcher = self.descent.watcher
        del watcher.robot[:-1], watcher.motions[:-1], watcher.commands[:-1], watcher.fixture[:-1]
        with kind() as fault:
            self.stack.elapse(_WATCHED_S)
        states = list(watcher.robot)
        violations = list(self._never(states))
        moved_s = _oldest(states, lambda s: bool(np.any(s.reference_twist)))
        if moved_s > COMMANDED_ZERO_WITHIN_S:
            violations.append(f"reference not zero {1e3 * moved_s:.0f} ms after the last command")
        coasted_s = _oldest(states, lambda s: _speed(s) > STANDING_M_S)
        if coasted_s > STANDS_WITHIN_S:
            violations.append(f"moves {1e3 * coasted_s:.0f} ms after the last command")
        self._mend()
        return Seen(fault, tuple(violations), moved_s, coasted_s)

    def _never(self, states: Sequence[Received[RobotState]]) -> Iterator[str]:
        """What must not be, whatever happens."""
        deepest_m = min(map(self.descent.distance_m, states), default=0.0)
        if deepest_m < -INSIDE_M:
            yield f"{-1e3 * deepest_m:.2f} mm inside a forbidden region"
        fastest_m_s = max((_speed(state.body) for state in states), default=0.0)
        if fastest_m_s > FASTEST_M_S:
            yield f"{1e3 * fastest_m_s:.0f} mm/s"

    def _moves(self) -> bool:
        watcher, until_s = self.descent.watcher, time.monotonic() + BACK_WITHIN_S
        del watcher.robot[:]
        while time.monotonic() < until_s:
            self.stack.pump()
            if watcher.robot and _speed(watcher.robot[-1].body) > MOVING_M_S:
                return True
        return False

    # --- what goes wrong; each yields its name ---------------------------------------------------

    @contextlib.contextmanager
    def _kill(self) -> Iterator[str]:
        service = self._any()
        self.processes[service].send(signal.SIGKILL)
        yield f"{service} killed"

    @contextlib.contextmanager
    def _hang(self) -> Iterator[str]:
        service = self._any()
        self.processes[service].send(signal.SIGSTOP)
        try:
            yield f"{service} hung"
        finally:
            self.processes[service].send(signal.SIGCONT)

    @contextlib.contextmanager
    def _router(self) -> Iterator[str]:
        # What the robot does meanwhile cannot be seen; what it has done can.
        if self._rng.random() < 0.5:
            self.stack.router.send(signal.SIGKILL)
            self.stack.router.wait(10.0)
            yield "router killed"
            self.stack.start_router()
            return
        self.stack.router.send(signal.SIGSTOP)
        try:
            yield "router hung"
        finally:
            self.stack.router.send(signal.SIGCONT)

    @contextlib.contextmanager
    def _load(self) -> Iterator[str]:
        name = str(self._rng.choice(["busy loops", "memory", "descriptors"]))
        with contextlib.ExitStack() as ended:
            if name == "descriptors":
                host, _, port = self.stack.endpoint.partition("/")[2].rpartition(":")
                for _ in range(_CONNECTIONS):
                    ended.enter_context(socket.create_connection((host, int(port))))
            else:
                program, count = (_BUSY, 8) if name == "busy loops" else (_MEMORY_HOG, 1)
                for _ in range(count):
                    ended.enter_context(hog(program))
            yield name

    @contextlib.contextmanager
    def _disk(self) -> Iterator[str]:
        shutil.rmtree(self._folder / "takes", ignore_errors=True)
        yield "the recorder's folder gone"

    @contextlib.contextmanager
    def _flood(self) -> Iterator[str]:
        self.descent.flood(2000)
        yield "flooded"

    def _mend(self) -> None:
        ended = [service for service, process in self.processes.items() if not process.running]
        for service in ended:
            self._start(service)
        self.stack.until_ready(*(self.processes[service] for service in ended))

    def _any(self) -> str:
        return str(self._rng.choice(list(self.processes)))

    def _start(self, service: str) -> None:
        self._count += 1
        self.processes[service] = self._commands[service](f"{service}-{self._count}")


@contextlib.contextmanager
def hog(program: str = _BUSY) -> Iterator[None]:
    """Keep a core busy, or what a program takes."""
    process = subprocess.Popen([sys.executable, "-c", program])
    try:
        yield
    finally:
        process.kill()
        process.wait()


def measure(trials: int, seed: int, hogs: int, progress: Progress) -> list[Figure]:
    """Let so many things go wrong, `hogs` busy loops beside it all the while."""
    done = progress.add_task("faults", total=trials)
    seen: list[Seen] = []
    with contextlib.ExitStack() as loaded:
        for _ in range(hogs):
            loaded.enter_context(hog())
        for number in range(-(-trials // TRIALS_OF_A_STACK)):
            with (
                tempfile.TemporaryDirectory(prefix="hmcs-faults-") as name,
                Stack(Path(name) / "logs") as stack,
            ):
                rng = np.random.default_rng([seed, number])
                world = World(stack, Path(name), number, rng)
                for _ in range(min(TRIALS_OF_A_STACK, trials - len(seen))):
                    seen.append(world.trial())
                    progress.advance(done)
                    if seen[-1].violations:
                        progress.print(f"{seen[-1].fault}: {'; '.join(seen[-1].violations)}")
                world.descent.close()
    kinds = Counter(each.fault for each in seen)
    moved_ms = [1e3 * each.moved_s for each in seen]
    coasted_ms = [1e3 * each.coasted_s for each in seen]
    return [
        *(Figure(kind, count) for kind, count in sorted(kinds.items())),
        Figure("faults", len(seen)),
        Figure("violations", sum(bool(each.violations) for each in seen), at_most=0),
        Figure(
            "reference not zero after the last command, worst",
            max(moved_ms),
            "ms",
            at_most=1e3 * COMMANDED_ZERO_WITHIN_S,
        ),
        Figure(
            "moving after the last command, worst",
            max(coasted_ms),
            "ms",
            at_most=1e3 * STANDS_WITHIN_S,
        ),
    ]


def _speed(state: RobotState) -> float:
    return float(np.linalg.norm(state.tool_twist[:3]))


def _oldest(states: Sequence[Received[RobotState]], moving: Callable[[RobotState], bool]) -> float:
    """Return the age of the oldest command with which the robot was still `moving`, s."""
    ages_s = (s.body.command_age_s or 0.0 for s in states if moving(s.body))
    return max(ages_s, default=0.0)
