"""The stack of compose.yaml as processes on this machine, with the router inside this process."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import zenoh

from hmcs.bus.config import DEFAULT_ROUTER
from hmcs.bus.router import open_router
from hmcs.errors import UserError
from hmcs.task import load_task
from hmcs_local.compose import ROUTER, ServiceSpec, StackSpec, find_compose, load_compose
from hmcs_local.processes import StackProcess
from hmcs_secure.closed_cell import ClosedCell

ROUTER_IN_COMPOSE = "tcp/router:7447"
"""Where the services of compose.yaml look for the router; here it is the launcher's own."""
DEFAULT_FOLDER = Path("out/up")
LAYERED = ("gesteme-classifier", "task-hmm")
"""Services that run a model of the default kind, spread over processes."""
_ONE_SHOT_LOOK_S = 0.05


class StackError(UserError):
    """The stack cannot do what was asked of it; says what to do."""


class OneShotFailedError(StackError):
    """A service the others wait for has failed."""

    def __init__(self, message: str, exit_code: int) -> None:
        super().__init__(message)
        self.exit_code = exit_code


class LocalStack:
    """Starts services of compose.yaml as processes here and ends them all on leaving the `with`.

    `services` are those to start (None: all); the router is among them and embedded unless it is
    left out, then the one at `router` is joined. Services that others wait for (one-shots) run to
    their end first, within `__enter__`. `scale` overrides how many instances a service has,
    `environment` adds to the environment of a service, by service name; a variable that is None
    there is left out. `router` may end in `:0`:
    a free port is chosen and `stack.router` names it. Every volume of compose.yaml is a folder of
    `folder`, which also holds `logs/INSTANCE.log`. `variables` fill in `${NAME}` in compose.yaml
    and default to this process' environment; HMCS_* variables reach the services no other way.
    `open_to_network` lets the embedded router listen beyond this machine without TLS. `closed` is
    the closed cell this is: every process comes with its certificate, and the router, at a tls
    endpoint, refuses everybody else.
    `while_waiting` is called again and again while a one-shot runs. `fetch` is called with the
    router and the model files that the services begin with and nobody here makes, where they are
    not there.

    Raises ComposeError, StackError, AuthorityError and RouterError for what the user can mend, and
    OneShotFailedError where a one-shot does not end with 0. Not for use from several threads: the
    processes die with the thread that started them.
    """

    def __init__(
        self,
        compose: Path | StackSpec | None = None,
        *,
        services: Sequence[str] | None = None,
        scale: Mapping[str, int] | None = None,
        router: str = DEFAULT_ROUTER,
        folder: Path = DEFAULT_FOLDER,
        environment: Mapping[str, Mapping[str, str | None]] | None = None,
        variables: Mapping[str, str] | None = None,
        open_to_network: bool = False,
        closed: ClosedCell | None = None,
        while_waiting: Callable[[], None] = lambda: None,
        fetch: Callable[[str, Sequence[Path]], None] = lambda _router, _files: None,
    ) -> None:
        if not isinstance(compose, StackSpec):
            path = compose or find_compose(Path.cwd())
            compose = load_compose(path, os.environ if variables is None else variables)
        self.spec = compose
        self.router = with_free_port(router)
        self._closed = closed
        if closed is not None and not self.router.startswith("tls/"):
            raise StackError(
                f"--router {router}: the router of a closed cell listens on tls/HOST:PORT"
            )
        self.folder = folder.resolve()
        self.processes: dict[str, StackProcess] = {}
        """Every service instance started, by instance name; also those that have ended."""
        self._chosen = self.spec.select(tuple(services or self.spec.usual))
        self._scale = dict(scale or {})
        for name, count in self._scale.items():
            spec = self.spec.service(name)
            if count < 0 or name == ROUTER or spec.one_shot:
                raise StackError(f"--scale {name}={count}: expected a service and 0 or more")
        self._environment = {name: dict(more) for name, more in (environment or {}).items()}
        for name in self._environment:
            self.spec.service(name)
        self._open_to_network = open_to_network
        self._while_waiting = while_waiting
        self._fetch = fetch
        self._asked: dict[str, tuple[tuple[str, ...], dict[str, str]]] = {}
        self._router_session: zenoh.Session | None = None
        self._numbers: dict[str, int] = {}

    def __enter__(self) -> Self:
        try:
            self.start_all()
        except BaseException:
            self.stop_all()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.stop_all()

    # --- all of it --------------------------------------------------------------------------------

    def start_all(self) -> None:
        """Start the router, run the one-shots, start every service: the order of compose.yaml."""
        if self.spec.services[ROUTER] in self._chosen:
            self.start_router()
        if missing := self._missing_models():
            self._fetch(self.router, missing)
        for spec in self._chosen:
            if spec.one_shot:
                self._run_one_shot(spec)
            elif spec.name != ROUTER:
                for _ in range(self._scale.get(spec.name, spec.scale)):
                    self.start(spec.name)

    def stop_all(self) -> dict[str, int]:
        """End every process, then the router; returns exit codes by instance.

        All get SIGTERM at once, and each SIGKILL after its own grace.
        """
        asked_s = time.monotonic()
        for process in self.processes.values():
            process.ask_to_stop()
        codes = {
            instance: process.finish(asked_s + process.stop_grace_s)
            for instance, process in self.processes.items()
        }
        self.stop_router()
        return codes

    # --- the router -------------------------------------------------------------------------------

    def start_router(self) -> None:
        """Start the embedded router; raises RouterError where its port is taken."""
        if self._router_session is None:
            file = None
            if self._closed is not None:
                self.folder.mkdir(parents=True, exist_ok=True)
                file = self._closed.write_router(self.folder / "router.json5", self.router)
            self._router_session = open_router(
                self.router, file, open_to_network=self._open_to_network
            )

    def stop_router(self) -> None:
        """Close the embedded router; nothing where there is none."""
        if self._router_session is not None:
            self._router_session.close()  # type: ignore[no-untyped-call]
            self._router_session = None

    # --- one service ------------------------------------------------------------------------------

    def start(
        self,
        service: str,
        *,
        command: Sequence[str] | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> StackProcess:
        """Start one more instance, under the next free name `SERVICE-N`; returns its process.

        `command` stands in for the one of compose.yaml, `environment` adds to the one there.
        Raises StackError for the router, and where the command is not there or cannot be started.
        """
        spec = self.spec.service(service)
        if spec.name == ROUTER:
            raise StackError("the router is embedded: it cannot be started as a process")
        self._numbers[service] = self._numbers.get(service, 0) + 1
        instance = service if spec.one_shot else f"{service}-{self._numbers[service]}"
        return self._start(spec, instance, tuple(command or spec.command), environment or {})

    def restart(self, instance: str) -> StackProcess:
        """Start an instance that has ended again, under its name, as it was started before."""
        ended = self.processes[instance]
        if ended.running:
            raise StackError(f"{instance} runs already")
        return self._start(self.spec.service(ended.service), instance, *self._asked[instance])

    def instances(self, service: str) -> list[StackProcess]:
        """Return the running instances of a service, oldest first."""
        self.spec.service(service)
        return [p for p in self.processes.values() if p.service == service and p.running]

    def instance(self, service: str, index: int = 0) -> StackProcess:
        """Return one running instance; raises StackError where there are not so many."""
        running = self.instances(service)
        try:
            return running[index]
        except IndexError:
            raise StackError(f"{service}: {len(running)} run, none has index {index}") from None

    def kill(
        self, service: str, index: int = 0, signal_number: int = signal.SIGKILL
    ) -> StackProcess:
        """Send a signal (SIGKILL) to a running instance; returns its process.

        With SIGKILL and SIGTERM its end is waited for and counts as wanted.
        """
        process = self.instance(service, index)
        if signal_number == signal.SIGKILL:
            process.stopping = True
            process.kill()
        elif signal_number == signal.SIGTERM:
            process.stop()
        else:
            process.send(signal_number)
        return process

    def volume(self, name: str) -> Path:
        """Return the folder that stands for a volume of compose.yaml, made if it is not there."""
        folder = self.folder / name
        folder.mkdir(parents=True, exist_ok=True)
        return folder

    def _missing_models(self) -> list[Path]:
        """The model files of the services to start that are not there, unless a one-shot runs."""
        if any(spec.one_shot for spec in self._chosen):
            return []
        named = [
            file
            for spec in self._chosen
            for file in _model_files(spec.name, self._local_environment(spec, "", {}))
        ]
        return [file for file in dict.fromkeys(named) if not file.exists()]

    def _run_one_shot(self, spec: ServiceSpec) -> None:
        before = self._models_of(spec)
        process = self.start(spec.name)
        while process.wait(_ONE_SHOT_LOOK_S) is None:
            self._while_waiting()
        self._while_waiting()
        if code := process.exit_code:
            last = "\n".join(f"  {line}" for line in process.last_lines())
            raise OneShotFailedError(f"{spec.name} failed with exit code {code}:\n{last}", code)
        if self._closed is not None and self._closed.signed_models:
            self._closed.sign(path for path, _ in self._models_of(spec) - before)
        del self.processes[spec.name]

    def _models_of(self, spec: ServiceSpec) -> set[tuple[Path, int]]:
        """Every model file in the volumes of a service, and when it was written."""
        return {
            (path, path.stat().st_mtime_ns)
            for volume in spec.volumes.values()
            for path in self.volume(volume).rglob("*.hmcs")
        }

    def _start(
        self,
        spec: ServiceSpec,
        instance: str,
        command: tuple[str, ...],
        environment: Mapping[str, str],
    ) -> StackProcess:
        program = sys.executable if command[0] == "python" else shutil.which(command[0])
        if program is None:
            raise StackError(
                f"{instance}: no program {command[0]!r} here: install it or name another"
            )
        try:
            process = StackProcess(
                spec.name,
                instance,
                (program, *(self._local(spec, word) for word in command[1:])),
                self._local_environment(spec, instance, environment),
                self.folder / "logs" / f"{instance}.log",
                spec.stop_grace_s,
            )
        except OSError as error:
            raise StackError(f"{instance}: cannot be started in {self.folder}: {error}") from error
        self.processes[instance] = process
        self._asked[instance] = (command, dict(environment))
        return process

    # --- from compose.yaml to this machine --------------------------------------------------------

    def _local_environment(
        self, spec: ServiceSpec, instance: str, more: Mapping[str, str]
    ) -> dict[str, str]:
        inherited = {k: v for k, v in os.environ.items() if not k.startswith("HMCS_")}
        named = {"HMCS_INSTANCE": instance} if "HMCS_ROUTER" in spec.environment else {}
        closed: dict[str, str] = {}
        if named and self._closed is not None:
            closed = self._closed.environment(spec.name.replace("-", "_"), instance)
        composed = {key: self._local(spec, value) for key, value in spec.environment.items()}
        given = {
            "OMP_NUM_THREADS": "1",
            **inherited,
            **composed,
            **named,
            **closed,
            **self._environment.get(spec.name, {}),
            **more,
        }
        return {key: value for key, value in given.items() if value is not None}

    def _local(self, spec: ServiceSpec, text: str) -> str:
        places = {inside: self.volume(name) for inside, name in spec.volumes.items()}
        for inside, place in (places | dict(spec.mounts)).items():
            here = str(place).replace("\\", r"\\")
            text = re.sub(rf"(?<![\w./-]){re.escape(inside)}(?![\w.-])", here, text)
        return text.replace(ROUTER_IN_COMPOSE, self.router)


def _model_files(service: str, environment: Mapping[str, str]) -> Iterator[Path]:
    """The model files that a service needs, from its settings.

    Of a folder of models that is the file of the service's task, where it has nothing to do
    without one.
    """
    words = [environment.get("HMCS_MODEL", ""), *json.loads(environment.get("HMCS_MODELS", "[]"))]
    for place in map(Path, filter(None, words)):
        if place.suffix == ".hmcs":
            yield place
        elif service in LAYERED and (task := environment.get("HMCS_TASK")):
            yield place / f"{load_task(task).name}.hmcs"


def with_free_port(endpoint: str) -> str:
    """Return `endpoint` with a free port in the place of a port 0."""
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.rpartition(":")
    if port != "0":
        return endpoint
    with socket.create_server((host, 0)) as server:
        return f"{protocol}/{host}:{server.getsockname()[1]}"
