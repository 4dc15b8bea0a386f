"""A router on a free port and real processes around it, all of them ended with the `with`."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from hmcs.bus.keys import Member
from hmcs.bus.messages import Ask, Health
from hmcs.bus.rights import OPERATOR, roles
from hmcs.bus.session import Bus, BusSettings, RequestRefusedError
from hmcs.bus.verbs import HEALTH
from hmcs_local.processes import StackProcess
from hmcs_local.stack import with_free_port
from hmcs_secure.closed_cell import ClosedCell

CELL = "test"
DEADLINE_S = 60.0
"""What has not come about after so long never will."""
HEALTH_WITHIN_S = 5.0
ASK_AGAIN_S = 0.2
PATIENT_ROBOT = ("--hang-s", 0.5, "--command-valid-for-ms", 500, "--late-tick-s", 0.5)
"""Of a robot whose way is looked at, not its stops: a machine that stands still is no fault."""
PATIENT_FIXTURE = (
    *("--input-stale-after-ms", 500, "--command-valid-for-ms", 500),
    *("--belief-stale-after-ms", 500),
)
"""The same of a fixture controller."""
_LOOK_S = 0.003


class Stack:
    """Processes on one router. The router is a process of its own, so that it can be killed.

    Buses opened here are pumped while `until` waits; nothing else reads the clock. In a `closed`
    cell every process and every bus comes with the certificate of its role.
    """

    def __init__(self, folder: Path, closed: ClosedCell | None = None) -> None:
        self.folder, self.closed = folder, closed
        self.cell = CELL if closed is None else closed.name
        self.endpoint = with_free_port("tcp/127.0.0.1:0" if closed is None else "tls/127.0.0.1:0")
        self.processes: list[StackProcess] = []
        self.present: set[Member] = set()
        """Who is there and ready, once `watch` was called."""
        self._buses: list[Bus] = []
        self._contexts = contextlib.ExitStack()
        self.router: StackProcess

    def __enter__(self) -> Self:
        try:
            self.start_router()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close every bus and kill every process; all has been said that the tests want to hear."""
        self._contexts.close()
        for process in self.processes:
            process.send(signal.SIGKILL)
        for process in self.processes:
            process.wait(DEADLINE_S)

    # --- processes --------------------------------------------------------------------------------

    def start_router(self) -> None:
        """Start the router, on the same port each time."""
        words: tuple[object, ...] = ("--listen", self.endpoint)
        if self.closed is not None:
            file = self.closed.write_router(self.folder / "router.json5", self.endpoint)
            words = ("--config", file)
        self.router = self._spawn("router", "router", "hmcs.bus.router", *words)

    def start(self, service: str, instance: str, *flags: object) -> StackProcess:
        """Start a service on this router; returns at once. A word before all flags comes first."""
        words = flags[:1] if flags and not str(flags[0]).startswith("-") else ()
        return self._spawn(
            service,
            instance,
            f"hmcs_{service}",
            *words,
            *("--router", self.endpoint, "--cell", self.cell, "--instance", instance),
            *flags[len(words) :],
        )

    def bring_up(self, service: str, instance: str, *flags: object) -> StackProcess:
        """Start a service and wait until it is ready."""
        process = self.start(service, instance, *flags)
        self.until_ready(process)
        return process

    def start_program(
        self, service: str, instance: str, file: Path, *flags: object
    ) -> StackProcess:
        """Start a program that lives as a service, from its file; returns at once."""
        place = ("--router", self.endpoint, "--cell", self.cell, "--instance", instance)
        return self._run(
            service, instance, [sys.executable, str(file), *map(str, (*place, *flags))]
        )

    def until_ready(self, *processes: StackProcess, within_s: float = DEADLINE_S) -> None:
        """Wait until these are present; fail at once where one has ended instead."""
        wanted = {Member(process.service, process.instance) for process in processes}

        def ready() -> bool:
            for process in processes:
                assert process.running, "\n".join(process.last_lines())
            return wanted <= self.present

        self.until(ready, within_s)

    def until_gone(self, process: StackProcess) -> None:
        """Wait until nobody sees a process any more."""
        self.until(lambda: Member(process.service, process.instance) not in self.present)

    def _spawn(self, service: str, instance: str, module: str, *flags: object) -> StackProcess:
        return self._run(service, instance, [sys.executable, "-m", module, *map(str, flags)])

    def _run(self, service: str, instance: str, command: list[str]) -> StackProcess:
        process = StackProcess(
            service,
            instance,
            command,
            clean_environment() | self._certificates(service, instance),
            self.folder / f"{len(self.processes)}-{service}-{instance}.log",
            stop_grace_s=DEADLINE_S,
        )
        self.processes.append(process)
        return process

    def _certificates(self, service: str, instance: str) -> dict[str, str]:
        if self.closed is None or service not in roles():
            return {}
        return self.closed.environment(service, instance)

    # --- the bus ----------------------------------------------------------------------------------

    def open_bus(self, service: str, instance: str) -> Bus:
        """Open a bus in this process; it is pumped by `until` and closed at the end."""
        settings = self.settings(service if service in roles() else OPERATOR)
        bus = self._contexts.enter_context(Bus.open(settings, service, instance))
        self._buses.append(bus)
        return bus

    def settings(self, role: str) -> BusSettings:
        """Return how a process of a role reaches the others."""
        tls = {} if self.closed is None else self.closed.credentials(role)._asdict()
        return BusSettings(
            router=self.endpoint, cell=self.cell, connect_timeout_s=DEADLINE_S, **tls
        )

    def watch(self, bus: Bus) -> None:
        """Follow on `bus` who is there."""

        def change(key: str, alive: bool) -> None:
            (self.present.add if alive else self.present.discard)(bus.keys.member_of(key))

        bus.watch(bus.keys.presence(), change)

    def pump(self) -> None:
        """Handle whatever has arrived on the buses of this process; wait a moment for it."""
        for bus in self._buses:
            bus.pump(_LOOK_S / len(self._buses))

    def until(self, condition: Callable[[], Any], within_s: float = DEADLINE_S) -> Any:
        """Pump until `condition` is true and return what it gave; fail when it is not in time."""
        deadline_s = time.monotonic() + within_s
        while not (value := condition()):
            assert time.monotonic() < deadline_s, f"did not come about within {within_s:g} s"
            self.pump()
        return value

    def elapse(self, duration_s: float) -> None:
        """Pump for a time: for what must *not* happen, or for a stream to run on."""
        end_s = time.monotonic() + duration_s
        while time.monotonic() < end_s:
            self.pump()

    def health(self, process: StackProcess) -> Health:
        """Ask a process how it is; fail where it does not answer in time."""
        health = self.health_within(process, HEALTH_WITHIN_S)
        assert health is not None, f"{process.instance} did not answer"
        return health

    def health_within(self, process: StackProcess, within_s: float) -> Health | None:
        """Ask a process how it is; None where it does not answer in time."""
        deadline_s = time.monotonic() + within_s
        while (left_s := deadline_s - time.monotonic()) > 0:
            with contextlib.suppress(RequestRefusedError):
                answers = HEALTH.ask(
                    self._buses[0],
                    Ask(),
                    service=process.service,
                    instance=process.instance,
                    timeout_s=left_s,
                )
                if answers:
                    return answers[0].body
            # On a machine that stalls this process loses its own link to the router for a moment.
            self.elapse(ASK_AGAIN_S)
        return None


def clean_environment() -> dict[str, str]:
    """Return this process' environment without settings of HMCS, with one thread for numpy.

    What tests import, the processes they start import as well.
    """
    kept = {key: value for key, value in os.environ.items() if not key.startswith("HMCS_")}
    return {**kept, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(Path(__file__).parent.parent)}


def log_events(process: StackProcess) -> list[dict[str, Any]]:
    """Return the events a process has logged so far."""
    lines = process.log_path.read_text(encoding="utf-8").splitlines()
    return [json.loads(line) for line in lines if line.startswith("{")]


def run_python(
    words: Sequence[str], folder: Path | None = None, within_s: float = DEADLINE_S
) -> subprocess.CompletedProcess[str]:
    """Run `python …` to its end, in a folder where one is given."""
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env=clean_environment(),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=within_s,
        check=False,
    )


def run_to_end(
    command: Sequence[str], within_s: float = DEADLINE_S
) -> subprocess.CompletedProcess[str]:
    """Run `python -m …` to its end."""
    return run_python(["-m", *command], within_s=within_s)
