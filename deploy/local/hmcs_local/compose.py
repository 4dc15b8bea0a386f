"""Reads the stack from compose.yaml: the part of the Compose format the stack uses, and no more."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Any, Literal

import yaml

from hmcs.errors import UserError
from hmcs.task.values import unknown_name_message

COMPOSE = "compose.yaml"
ROUTER = "router"
"""The service that is the router: the launcher has it inside itself."""

Restart = Literal["no", "on-failure", "always", "unless-stopped"]
_RESTARTS: tuple[Restart, ...] = ("no", "on-failure", "always", "unless-stopped")
_VARIABLE = re.compile(r"\$\{(?P<name>\w+)(?::-(?P<default>[^}]*))?\}|\$\$")
_SECONDS = re.compile(r"(?P<number>\d+(?:\.\d+)?)(?P<unit>ms|s|m)")
_UNIT_S = {"ms": 0.001, "s": 1.0, "m": 60.0}


class ComposeError(UserError):
    """A compose file that cannot be run here; says where and what was expected."""


@dataclass(frozen=True)
class ServiceSpec:
    """One service of the stack, as compose.yaml describes it."""

    name: str
    command: tuple[str, ...]
    """Empty for the router, whose command is its image's own."""
    environment: Mapping[str, str]
    optional: bool
    """True behind a profile: it runs where it is named, and not by default."""
    scale: int
    needs: tuple[str, ...]
    """Services that come before it."""
    one_shot: bool
    """True where others wait until it has completed."""
    restart: Restart
    stop_grace_s: float
    volumes: Mapping[str, str]
    """Folder in the container to the name of the volume that stands there."""
    mounts: Mapping[str, Path]
    """Folder in the container to the folder of this machine that stands there."""


@dataclass(frozen=True)
class StackSpec:
    """The stack of a compose file."""

    path: Path
    services: Mapping[str, ServiceSpec]
    """By name, each after the services it needs."""
    variables: frozenset[str]
    """Names of the variables it takes from the environment."""

    @property
    def usual(self) -> tuple[str, ...]:
        """Names of the services that run where none are named."""
        return tuple(name for name, spec in self.services.items() if not spec.optional)

    def select(self, names: tuple[str, ...]) -> tuple[ServiceSpec, ...]:
        """Return the named services in starting order; raises ComposeError for an unknown name."""
        for name in names:
            self.service(name)
        return tuple(spec for spec in self.services.values() if spec.name in names)

    def service(self, name: str) -> ServiceSpec:
        """Return one service; raises ComposeError where there is none of that name."""
        try:
            return self.services[name]
        except KeyError:
            unknown = unknown_name_message("service", name, self.services)
            raise ComposeError(f"{self.path}: {unknown}") from None


def find_compose(start: Path) -> Path:
    """Return the compose.yaml in `start` or above it, else the one that came with this package.

    Raises ComposeError where there is none.
    """
    for folder in (start.resolve(), *start.resolve().parents):
        if (folder / COMPOSE).is_file():
            return folder / COMPOSE
    return own_compose()


def own_compose() -> Path:
    """Return the compose.yaml that came with this package.

    A wheel has it inside the package, a checkout at the root of the repository. Raises ComposeError
    where neither is there.
    """
    for folder in Path(__file__).resolve().parents:
        if (folder / COMPOSE).is_file():
            return folder / COMPOSE
    raise ComposeError(
        f"no {COMPOSE} came with hmcs-local: install it anew, or name a file with --compose FILE"
    )


def load_compose(path: Path, variables: Mapping[str, str]) -> StackSpec:
    """Read the stack; `variables` fill in `${NAME:-default}`.

    Raises ComposeError for a file that cannot be read or says what cannot be run as a process.
    """
    try:
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ComposeError(f"{path}: cannot be read: {error.strerror}") from None
    except yaml.YAMLError as error:
        raise ComposeError(f"{path}: is no YAML: {error}") from None
    services = document.get("services") if isinstance(document, dict) else None
    if not isinstance(services, dict) or not services:
        raise ComposeError(f"{path}: has no `services:`, expected a compose file of the stack")
    for name, service in services.items():
        if not isinstance(service, dict):
            raise ComposeError(f"{path}: services.{name}: expected a mapping")
    if ROUTER not in services:
        raise ComposeError(f"{path}: services: expected one named {ROUTER}")
    filled = {name: _fill(service, variables) for name, service in services.items()}
    awaited = {
        needed
        for service in filled.values()
        for needed, how in _needs(service).items()
        if how == "service_completed_successfully"
    }
    specs = {name: _spec(path, name, service, awaited) for name, service in filled.items()}
    order = TopologicalSorter({name: spec.needs for name, spec in specs.items()})
    try:
        in_order = {name: specs[name] for name in order.static_order()}
    except CycleError as error:
        raise ComposeError(f"{path}: services wait for each other: {error.args[1]}") from None
    except KeyError as error:
        raise ComposeError(f"{path}: a service depends on {error}, which is not there") from None
    return StackSpec(path, in_order, frozenset(_named(document)))


def _spec(path: Path, name: str, service: dict[str, Any], awaited: set[str]) -> ServiceSpec:
    where = f"{path}: services.{name}"
    command = service.get("command", [])
    if not isinstance(command, list) or bool(command) == (name == ROUTER):
        raise ComposeError(f"{where}.command: expected a list, and none for {ROUTER}")
    environment = service.get("environment", {})
    if not isinstance(environment, dict):
        raise ComposeError(f"{where}.environment: expected a mapping of names to values")
    restart = service.get("restart", "no")
    if restart not in _RESTARTS:
        raise ComposeError(f'{where}.restart: {restart!r} is none of "{_RESTARTS}"')
    scale = service.get("scale", 1)
    if not isinstance(scale, int) or scale < 0:
        raise ComposeError(f"{where}.scale: {scale!r}, expected 0 or more")
    volumes = [str(volume).split(":") for volume in service.get("volumes", [])]
    if any(len(volume) < 2 or not volume[1].startswith("/") for volume in volumes):
        raise ComposeError(f"{where}.volumes: expected NAME:/folder or ./FOLDER:/folder for each")
    mounted = {inside: outside for outside, inside, *_ in volumes}
    return ServiceSpec(
        name=name,
        command=tuple(str(word) for word in command),
        environment={key: str(value) for key, value in environment.items()},
        optional=bool(service.get("profiles")),
        scale=scale,
        needs=tuple(_needs(service)),
        one_shot=name in awaited,
        restart=restart,
        stop_grace_s=_seconds(where, str(service.get("stop_grace_period", "10s"))),
        volumes={inside: name for inside, name in mounted.items() if not _is_path(name)},
        mounts={
            inside: (path.parent / Path(outside).expanduser()).resolve()
            for inside, outside in mounted.items()
            if _is_path(outside)
        },
    )


def _is_path(outside: str) -> bool:
    """Whether the left side of a volume is a folder of this machine, by the rule of Compose."""
    return outside.startswith((".", "/", "~"))


def _needs(service: dict[str, Any]) -> dict[str, str]:
    needs = service.get("depends_on", {})
    if isinstance(needs, list):
        return dict.fromkeys(needs, "service_started")
    return {name: how["condition"] for name, how in needs.items()}


def _fill(node: Any, variables: Mapping[str, str]) -> Any:
    if isinstance(node, dict):
        return {key: _fill(value, variables) for key, value in node.items()}
    if isinstance(node, list):
        return [_fill(value, variables) for value in node]
    if isinstance(node, str):
        return _VARIABLE.sub(lambda match: _value(match, variables), node)
    return node


def _named(node: Any) -> Iterator[str]:
    """Yield the variables that are named anywhere in a document."""
    if isinstance(node, dict | list):
        for each in node.values() if isinstance(node, dict) else node:
            yield from _named(each)
    elif isinstance(node, str):
        yield from (match["name"] for match in _VARIABLE.finditer(node) if match["name"])


def _value(match: re.Match[str], variables: Mapping[str, str]) -> str:
    if match["name"] is None:
        return "$"
    return variables.get(match["name"]) or match["default"] or ""


def _seconds(where: str, text: str) -> float:
    match = _SECONDS.fullmatch(text)
    if match is None:
        raise ComposeError(f"{where}.stop_grace_period: {text!r}, expected e.g. 2s or 500ms")
    return float(match["number"]) * _UNIT_S[match["unit"]]
