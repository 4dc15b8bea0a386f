"""Subcommands of `hmcs` that other installed distributions bring.

A subcommand is one function, as typer reads them, and one line in the entry-point group
`hmcs.commands` of its distribution. It is loaded with every `hmcs`, so its module imports little.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points

import typer

from hmcs.errors import UserError

GROUP = "hmcs.commands"
DISTRIBUTIONS = {"demo": "hmcs-demo"}
"""Which distribution of this project brings which subcommand."""


def add_commands(app: typer.Typer) -> None:
    """Add the subcommands of every installed distribution to `app`.

    One that cannot be loaded, or whose distribution is not installed, raises UserError where it is
    called, and says what to do.
    """
    entries = {entry.name: entry for entry in entry_points(group=GROUP)}
    for name, entry in sorted(entries.items()):
        try:
            app.command(name)(entry.load())
        except Exception as error:  # whatever is wrong with it, the other commands work
            _add_refusal(app, name, f"{entry.value} cannot be loaded: {error}; install it anew")
    for name, distribution in DISTRIBUTIONS.items():
        if name not in entries:
            _add_refusal(
                app,
                name,
                f"needs the distribution {distribution}, which is not installed: install it "
                f"beside hmcs-local, e.g. uv tool install hmcs-local --with {distribution}",
            )


def _add_refusal(app: typer.Typer, name: str, why: str) -> None:
    app.command(
        name,
        hidden=True,
        add_help_option=False,
        context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
    )(_refusal(f"hmcs {name}: {why}"))


def _refusal(message: str) -> Callable[[], None]:
    def refuse() -> None:
        raise UserError(message)

    return refuse
