"""Settings of a process: defaults < YAML file < `HMCS_*` environment < command line."""

from __future__ import annotations

import argparse
import re
import secrets
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, NoReturn, Self, TypeVar

import pydantic_settings
import yaml
from pydantic import BeforeValidator, Field, ValidationError, field_validator, model_validator
from pydantic_settings import BaseSettings, CliSettingsSource, EnvSettingsSource, SettingsConfigDict

from hmcs.bus.config import DEFAULT_ROUTER, BusSettings, check_endpoint, check_tls
from hmcs.bus.keys import check_name
from hmcs.errors import UserError

ENVIRONMENT_PREFIX = "HMCS_"


EMPTY_IS_NONE = BeforeValidator(lambda value: None if value == "" else value)
"""Of a setting that may be left out: an environment variable that is set to nothing sets nothing.
"""


_FACTORY = re.compile(r"\s*\(default factory: [^()]*\)")


class SettingsError(UserError):
    """Settings that cannot be used; says which one, where it came from and what is valid."""


class ServiceSettings(BaseSettings):
    """Settings of every service; a service adds its own fields, with units in their names."""

    model_config = SettingsConfigDict(
        env_prefix=ENVIRONMENT_PREFIX,
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        use_attribute_docstrings=True,
        cli_kebab_case=True,
        cli_implicit_flags=True,
    )

    router: str = DEFAULT_ROUTER
    """Endpoint of the router."""
    cell: str = "demo"
    """One operator with one robot; cells on one router do not see each other."""
    instance: str = Field(default_factory=lambda: secrets.token_hex(3))
    """Which one of its kind this process is; a short random name by default."""
    direct: bool = False
    """Talk to other direct processes without the router's hop, once it has introduced them."""
    open_to_network: bool = False
    """Let a direct process be reached from other hosts, too. There is no encryption and no
    password: everybody who reaches its port can move the robot."""
    tls_ca: Annotated[Path | None, EMPTY_IS_NONE] = None
    """Certificate of the closed cell's authority (PEM); with `tls_certificate` and `tls_key`."""
    tls_certificate: Annotated[Path | None, EMPTY_IS_NONE] = None
    """This process' own certificate (PEM)."""
    tls_key: Annotated[Path | None, EMPTY_IS_NONE] = None
    """The private key of that certificate (PEM)."""
    model_key: Annotated[Path | None, EMPTY_IS_NONE] = None
    """Public key (PEM) that model files have to be signed for; none by default."""
    connect_timeout_s: float | None = Field(default=None, gt=0)
    """How long to wait for a router; for ever by default."""
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    """The least severe events that are logged."""

    @field_validator("router")
    @classmethod
    def _router_is_an_endpoint(cls, router: str) -> str:
        return check_endpoint(router)

    @model_validator(mode="after")
    def _tls_is_whole(self) -> Self:
        check_tls(self)
        return self

    @field_validator("cell", "instance")
    @classmethod
    def _names_are_chunks(cls, name: str, info: Any) -> str:
        return check_name(info.field_name, name)

    @property
    def bus(self) -> BusSettings:
        """The part of them that says how to reach the others."""
        return BusSettings(
            router=self.router,
            cell=self.cell,
            direct=self.direct,
            open_to_network=self.open_to_network,
            tls_ca=self.tls_ca,
            tls_certificate=self.tls_certificate,
            tls_key=self.tls_key,
            connect_timeout_s=self.connect_timeout_s,
        )


S = TypeVar("S", bound=ServiceSettings)


class Loaded(NamedTuple):
    """Settings as they were found."""

    settings: Any
    print_only: bool
    """True where the command line asks for `--print-settings`."""


def load_settings(
    settings_type: type[ServiceSettings], program: str, argv: Sequence[str] | None = None
) -> Loaded:
    """Return the settings in force for `program` started with `argv`.

    Raises SettingsError for unknown options, unknown or invalid values from any source, and a file
    that cannot be read; SystemExit(0) after printing `--help`.
    """
    parser = _Parser(
        prog=_started_as(program), description=settings_type.__doc__, allow_abbrev=False
    )
    parser.add_argument("--settings", type=Path, metavar="FILE", help="YAML file of settings")
    parser.add_argument(
        "--print-settings", action="store_true", help="print the settings in force as YAML and end"
    )
    command_line = CliSettingsSource[Any](settings_type, root_parser=parser)
    parser.leave_factories_out()
    arguments = parser.parse_args(argv)
    try:
        environment = EnvSettingsSource(settings_type)()
    except pydantic_settings.SettingsError as error:
        raise SettingsError(
            f"environment {ENVIRONMENT_PREFIX}*: {error}: lists and maps are given as JSON there"
        ) from error
    layers: dict[str, Mapping[str, Any]] = {
        f"file {arguments.settings}": _read_file(arguments.settings, settings_type),
        "environment": environment,
        "command line": command_line(parsed_args=arguments)(),
    }
    values = {name: value for layer in layers.values() for name, value in layer.items()}
    try:
        return Loaded(settings_type(**values), arguments.print_settings)
    except ValidationError as error:
        raise SettingsError(_explain(error, layers)) from error


def as_yaml(settings: ServiceSettings) -> str:
    """Return settings as the YAML file that gives the same ones."""
    return yaml.safe_dump(settings.model_dump(mode="json"), sort_keys=False, allow_unicode=True)


def _started_as(program: str) -> str:
    """How a user starts this process: by its module where it is one of this program's own."""
    spec = getattr(sys.modules["__main__"], "__spec__", None)
    module = "" if spec is None else spec.name.removesuffix(".__main__")
    return f"python -m {module}" if program in module else program


class _Parser(argparse.ArgumentParser):
    def leave_factories_out(self) -> None:
        """Leave out of the help how a default is made: its text says what it is."""
        for action in self._actions:
            action.help = _FACTORY.sub("", action.help) if action.help else action.help

    def error(self, message: str) -> NoReturn:
        options = sorted(name for name in self._option_string_actions if name.startswith("--"))
        raise SettingsError(f"command line: {message} (valid options: {', '.join(options)})")


def _read_file(path: Path | None, settings_type: type[ServiceSettings]) -> dict[str, Any]:
    if path is None:
        return {}
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SettingsError(f"file {path}: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise SettingsError(f"file {path}: not YAML: {' '.join(str(error).split())}") from error
    if content is None:
        return {}
    if not isinstance(content, dict):
        raise SettingsError(
            f"file {path}: holds a {type(content).__name__}, expected lines of `name: value`"
        )
    valid = settings_type.model_fields
    unknown = [str(name) for name in content if name not in valid]
    if unknown:
        raise SettingsError(
            f"file {path}: unknown setting {', '.join(unknown)} (valid ones: {', '.join(valid)})"
        )
    return content


def _explain(error: ValidationError, layers: dict[str, Mapping[str, Any]]) -> str:
    problems = []
    for problem in error.errors(include_url=False):
        name = ".".join(str(part) for part in problem["loc"])
        field = str(problem["loc"][0]) if problem["loc"] else ""
        where = next((layer for layer in reversed(layers) if field in layers[layer]), "defaults")
        reason = problem["msg"].removeprefix("Value error, ")
        problems.append(f"{where}: {name or 'settings'}: {reason}, got {problem['input']!r}")
    return "; ".join(problems)
