"""Operator, recognizers and robot on three hosts, each with a router of its own."""

from __future__ import annotations

import contextlib
import json
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hmcs.bus.config import LINK_OPTIONS, UNICAST_OPTIONS
from hmcs.bus.messages import Ask, Belief, Health, Motion, RobotState
from hmcs.bus.session import Bus, BusSettings, Received
from hmcs.bus.verbs import HEALTH
from hmcs_local.processes import StackProcess
from hosts.network import Network
from support.stack import CELL, clean_environment

PORT = 7447
DEADLINE_S = 90.0
MOVING_M_S = 0.01
HOSTS = ("operator", "recognizers", "robot")


class SpreadCell:
    """The stack over three hosts, and an observer at the robot's router and one at each other."""

    def __init__(self, network: Network, folder: Path, model: Path, performance: Path) -> None:
        self.network, self._folder = network, folder
        self._contexts = contextlib.ExitStack()
        self._count = 0
        self.processes: dict[str, StackProcess] = {}
        self.routers: dict[str, StackProcess] = {}
        self.states: list[Received[RobotState]] = []
        self._fresh_from = 0
        self.motions: list[Received[Motion]] = []
        self.beliefs: list[Received[Belief]] = []
        self._buses: dict[str, Bus] = {}
        for host in HOSTS:
            self.start_router(host)
        for host in HOSTS:
            self._observe(host)
        models = json.dumps([str(model)])
        self._start("robot", "robot", "--task", "human-shapes")
        # The fixture controller stands beside the robot: what moves it crosses one link alone.
        self._start("robot", "fixture_controller", "--models", models)
        for number in (1, 2):
            self._start("recognizers", "gesteme_classifier", "--model", model, instance=number)
        self._start("recognizers", "task_hmm", "--model", model, "--deadline-ms", 60)
        self._start(
            "operator", "input_device", "--source", "recorded", "--demonstration", performance,
            "--rate-hz", 100, "--repeat", 0, "--re-engage",
        )  # fmt: skip

    def close(self) -> None:
        """End every process."""
        self._contexts.close()
        for process in (*self.processes.values(), *self.routers.values()):
            process.send(signal.SIGKILL)
        for process in (*self.processes.values(), *self.routers.values()):
            process.wait(DEADLINE_S)

    def start_router(self, host: str) -> None:
        """Start the router of a host, which dials those of the hosts after it in `HOSTS`.

        Of two routers one dials, again and again: the one whose address may change. Where both do,
        the one that is accepted does not dial anew when the other can no longer reach it.
        """
        here = self.network.hosts[host]
        others = [self.network.hosts[name] for name in HOSTS[HOSTS.index(host) + 1 :]]
        configuration = {
            "mode": "router",
            "listen": {"endpoints": [f"tcp/0.0.0.0:{PORT}"], "exit_on_failure": True},
            "connect": {
                "endpoints": [f"tcp/{other.addresses[host]}:{PORT}" for other in others],
                "exit_on_failure": False,
                "timeout_ms": -1,
                "retry": {
                    "period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 2
                },
            },
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}, "delay": 0},
            "transport": {"unicast": UNICAST_OPTIONS, "link": {"tx": LINK_OPTIONS}},
        }  # fmt: skip
        file = self._folder / f"{host}.json5"
        file.write_text(json.dumps(configuration))
        words = ("-m", "hmcs.bus.router", "--config", file, "--open-to-network")
        self.routers[host] = self._spawn(here.name, "router", f"router-{host}", words)

    def until(self, condition: Callable[[], Any], within_s: float = DEADLINE_S) -> Any:
        """Look until a condition is true; return what it gave."""
        deadline_s = time.monotonic() + within_s
        while not (value := condition()):
            assert time.monotonic() < deadline_s, (
                f"did not come about within {within_s:g} s; {self.last_seen()}"
            )
            self.look()
        return value

    def look(self) -> None:
        """Handle what has arrived at the observers."""
        for bus in self._buses.values():
            bus.pump(0.003)

    def look_for(self, seconds: float) -> None:
        """Handle what arrives for a time."""
        until_s = time.monotonic() + seconds
        while time.monotonic() < until_s:
            self.look()

    def forget(self) -> None:
        """Look at what comes from here on."""
        self._fresh_from = len(self.states)
        self.beliefs.clear()

    @property
    def fresh_states(self) -> list[Received[RobotState]]:
        """The robot's states since `forget`."""
        return self.states[self._fresh_from :]

    def released_since_it_stood(self) -> bool:
        """Whether the hand let go after the robot stopped the last time."""
        stopped = [k for k, received in enumerate(self.states) if received.body.stop != "none"]
        if not stopped:
            return True
        begin = stopped[-1]
        while begin > 0 and self.states[begin - 1].body.stop != "none":
            begin -= 1
        stood_ns = self.states[begin].received_ns
        return any(m.received_ns > stood_ns and not m.body.dead_man for m in self.motions)

    def follows(self) -> bool:
        """Whether the robot follows commands now, and they move it."""
        if not self.fresh_states:
            return False
        last = self.states[-1]
        return last.body.stop == "none" and _speed(last) > MOVING_M_S

    def last_seen(self) -> str:
        """Tell what robot and operator said last, and how long ago."""
        reported = [f"{len(self.fresh_states)} states, {len(self.beliefs)} beliefs"]
        if self.states:
            state, ago_s = self.states[-1].body, _ago_s(self.states[-1])
            reported.append(
                f"robot {ago_s:.1f} s ago: stop {state.stop}, contacts {state.contacts}, "
                f"at {state.tool_position}"
            )
        if self.motions:
            motion, ago_s = self.motions[-1].body, _ago_s(self.motions[-1])
            reported.append(f"hand {ago_s:.1f} s ago: dead_man {motion.dead_man}")
        return "; ".join(reported)

    def believes(self) -> bool:
        """Whether beliefs reach the robot's host."""
        return bool(self.beliefs)

    def health(self, host: str, service: str) -> Health | None:
        """Ask a service over the router of a host."""
        answers = HEALTH.ask(self._buses[host], Ask(), service=service, timeout_s=5.0)
        return answers[0].body if answers else None

    def _observe(self, host: str) -> None:
        endpoint = f"tcp/{self.network.hosts[host].watched_at}:{PORT}"
        settings = BusSettings(router=endpoint, cell=CELL, connect_timeout_s=DEADLINE_S)
        bus = self._contexts.enter_context(Bus.open(settings, "observer", f"at-{host}"))
        self._buses[host] = bus
        if host == "robot":
            bus.subscribe(RobotState, bus.keys.robot_state, self.states.append)
            bus.subscribe(Belief, bus.keys.belief(), self.beliefs.append)
        # What one observer misses while it is connected anew, the other may hear.
        if host in ("operator", "robot"):
            bus.subscribe(Motion, bus.keys.motion, self.motions.append)

    def _start(self, host: str, service: str, *flags: object, instance: int = 1) -> None:
        name = f"{service.replace('_', '-')}-{instance}"
        words = (
            "-m", f"hmcs_{service}", "--router", f"tcp/127.0.0.1:{PORT}", "--cell", CELL,
            "--instance", name, *flags,
        )  # fmt: skip
        self.processes[name] = self._spawn(host, service, name, words)

    def _spawn(self, host: str, service: str, name: str, words: tuple[object, ...]) -> StackProcess:
        self._count += 1
        return StackProcess(
            service,
            name,
            self.network.hosts[host].command([sys.executable, *words]),
            clean_environment(),
            self._folder / f"{self._count}-{name}.log",
            stop_grace_s=10.0,
        )


def _ago_s(received: Received[Any]) -> float:
    return (time.monotonic_ns() - received.received_ns) * 1e-9


def _speed(received: Received[RobotState]) -> float:
    return float(np.linalg.norm(received.body.tool_twist[:3]))
