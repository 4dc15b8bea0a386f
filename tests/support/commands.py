"""Every command of `hmcs` with its arguments and options, as the parser has them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, get_args, get_type_hints

import typer
from typer.models import ArgumentInfo, OptionInfo

GIVEN: Mapping[str, str] = {
    "task": "human-shapes",
    "recording": "gone",
    "demonstrations": "gone.csv",
    "files": "gone.csv",
    "sources": "gone.csv",
    "model": "good.hmcs",
    "models": "good.hmcs",
    "name": "assistance",
    "file": "puma560",
    "output": "made.hmcs",
    "to": "made",
    "service": "robot",
}
"""What arguments and options are given, by their names, where a command needs them."""


GIVEN_AS_WELL = ("study name", "swap instance")
"""Arguments that a command can do without, but then does something else."""


class Parameter(NamedTuple):
    """An argument, or an option of a command."""

    name: str
    option: str
    """As it is written, e.g. `--to`; empty for an argument."""
    required: bool
    is_path: bool
    metavar: str


class Command(NamedTuple):
    """A command as it is typed."""

    words: tuple[str, ...]
    parameters: tuple[Parameter, ...]

    def with_option(self, option: str = "", value: str = "") -> list[str]:
        """Return its words with what it needs, and one option besides."""
        words = list(self.words)
        for each in self.parameters:
            needed = each.required or " ".join((*self.words, each.name)) in GIVEN_AS_WELL
            if needed and each.option != option:
                words += [each.option] if each.option else []
                words.append(GIVEN.get(each.name, "gone"))
        return [*words, *([option, value] if option else [])]


def commands_of(app: typer.Typer, words: tuple[str, ...] = ()) -> Iterator[Command]:
    """Yield all commands of an app, those of its groups as well."""
    for info in app.registered_commands:
        if info.callback is not None and not info.hidden:
            name = info.name or info.callback.__name__.replace("_", "-")
            yield Command((*words, name), tuple(_parameters(info.callback)))
    for group in app.registered_groups:
        if group.typer_instance is not None:
            yield from commands_of(group.typer_instance, (*words, str(group.name)))


def _parameters(callback: Callable[..., Any]) -> Iterator[Parameter]:
    hints = get_type_hints(callback, include_extras=True)
    for name, parameter in inspect.signature(callback).parameters.items():
        kind, info = get_args(hints[name])[:2]
        # One of them, or a list of them, or none.
        kinds = {kind, *get_args(kind)}
        kinds |= {inner for each in kinds for inner in get_args(each)}
        option = ""
        if isinstance(info, OptionInfo):
            written = [each for each in info.param_decls or () if each.startswith("--")]
            option = written[0] if written else f"--{name.replace('_', '-')}"
        else:
            assert isinstance(info, ArgumentInfo)
        yield Parameter(
            name,
            option,
            parameter.default is inspect.Parameter.empty,
            Path in kinds,
            info.metavar or "",
        )
