"""Run the stack of compose.yaml or a router, see how it is: `up`, `status`, `router`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

from hmcs.bus.config import DEFAULT_ROUTER
from hmcs.errors import UserError
from hmcs.write_places import check_folder_place
from hmcs_local.commands.options import Cell, Folder, Open, Router, Secure, note
from hmcs_local.stack import DEFAULT_FOLDER, LocalStack
from hmcs_local.tables import screen


def up(
    task: Annotated[
        str | None,
        typer.Argument(
            help="Your task: a file (`hmcs new` writes one), or the name of one that comes along. "
            "Without one: the demo of compose.yaml.",
        ),
    ] = None,
    demonstrations: Annotated[
        list[str] | None,
        typer.Argument(help="Of the task, as `hmcs train` takes them: learned from first."),
    ] = None,
    task_option: Annotated[
        str | None, typer.Option("--task", metavar="TASK", help="The same as TASK.")
    ] = None,
    model: Annotated[
        Path | None, typer.Option(metavar="FILE", help="What recognizes the task from the start.")
    ] = None,
    source: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="What moves the hand: page (the default with a task), recorded, simulated, "
            "synthetic, gamepad, spacemouse, keyboard, mouse.",
        ),
    ] = None,
    recognizer: Annotated[
        str | None,
        typer.Option(metavar="KIND", help="What to learn from the demonstrations for."),
    ] = None,
    services: Annotated[
        str,
        typer.Option(
            metavar="A,B,…",
            help="Start these services only. Without `router` among them, the one at --router "
            "is joined.",
        ),
    ] = "",
    scale: Annotated[
        list[str] | None,
        typer.Option(metavar="SERVICE=N", help="So many instances of a service; may be repeated."),
    ] = None,
    router: Annotated[
        str,
        typer.Option(
            metavar="ENDPOINT", help="Where the embedded router listens; port 0: any free one."
        ),
    ] = DEFAULT_ROUTER,
    compose: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The stack; compose.yaml by default.")
    ] = None,
    folder: Folder = DEFAULT_FOLDER,
    open_to_network: Open = False,
    secure: Secure = None,
    signed_models: Annotated[
        bool,
        typer.Option(
            "--signed-models",
            help="With --secure: no process loads a model that is not signed for the cell, see "
            "`hmcs secure sign`.",
        ),
    ] = False,
) -> None:
    """Run the whole stack as processes here, with the router embedded: page, robot, recognition.

    With a task and neither demonstrations nor a model it waits to be taught on the page, and what
    is trained and activated there is followed at once. With --secure every process comes with its
    certificate, and the router refuses everybody else. Ctrl-C ends them all. `${NAME}` in
    compose.yaml is taken from the environment; HMCS_TASK there is the same as TASK.
    """
    from hmcs_local.bringing_up import Wanted, arrangement_of, task_named
    from hmcs_local.compose import find_compose, load_compose
    from hmcs_local.connecting import open_operator
    from hmcs_local.demonstration_files import expanded
    from hmcs_local.launcher import run_up
    from hmcs_local.model_fetching import fetch_models
    from hmcs_local.own_task import unheard
    from hmcs_secure.closed_cell import find_closed_cell
    from hmcs_secure.router_file import DEFAULT_LISTEN

    check_folder_place(folder, "--folder")
    if signed_models and not secure:
        raise UserError("--signed-models: name the closed cell whose key counts, by --secure")
    closed = find_closed_cell(secure, signed_models=signed_models) if secure else None
    if closed is not None and router == DEFAULT_ROUTER:
        router = DEFAULT_LISTEN
    chosen = tuple(name.strip() for name in services.split(",") if name.strip())
    console = Console(highlight=False, soft_wrap=True)
    spec = load_compose(compose or find_compose(Path.cwd()), os.environ)
    scales = dict(_scale(item) for item in scale or [])
    for name in (*chosen, *scales):
        spec.service(name)
    for name in unheard(os.environ, spec.variables | _OWN_VARIABLES):
        console.print(
            f"hmcs: {name} in the environment reaches no process: {spec.path} says what each is "
            "given; `hmcs up --help` lists what can be changed"
        )
    named = _one_task(task, task_option) or task_named(os.environ)
    files = tuple(expanded(demonstrations or (), folder, note))
    wanted = Wanted(named, files, model, source, recognizer)
    arrangement = arrangement_of(spec, folder, wanted, typer.echo)

    def fetch(router: str, files: Sequence[Path]) -> None:
        if signed_models:
            names = ", ".join(map(str, files))
            raise UserError(f"{names}: not there: copy each with its signature (.sig) to this host")
        cell = os.environ.get("HMCS_CELL") or "demo"
        with open_operator(router, cell, secure) as bus:
            for line in fetch_models(bus, files):
                console.print(f"hmcs: {line}")

    code = run_up(
        lambda while_waiting: LocalStack(
            spec,
            services=chosen or arrangement.services,
            environment=arrangement.environment,
            scale=scales,
            router=router,
            folder=folder,
            open_to_network=open_to_network,
            closed=closed,
            while_waiting=while_waiting,
            fetch=fetch,
        ),
        lambda who, what: console.print(_line(who, what)),
    )
    raise typer.Exit(code)


def status(
    once: Annotated[bool, typer.Option("--once", help="Show it once and end.")] = False,
    router: Router = DEFAULT_ROUTER,
    cell: Cell = "demo",
    secure: Secure = None,
) -> None:
    """Show who is there, how each is, rates, losses and the active model, and whether it is run.

    With --once, or where the output is no terminal, it is shown once, and the exit code is 0 when
    somebody is there, everybody is healthy and somebody runs the model that is followed, else 1.
    """
    from hmcs_local.connecting import open_observer
    from hmcs_local.status import show_status

    with open_observer(router, cell, secure) as bus:
        well = show_status(bus, screen(), once=once)
    raise typer.Exit(0 if well else 1)


def router(
    listen: Annotated[
        str | None,
        typer.Option(
            metavar="ENDPOINT",
            help=f"Where it listens; what --config names by default, or {DEFAULT_ROUTER}.",
        ),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(metavar="FILE", help="A Zenoh json5 file, for TLS, access, …")
    ] = None,
    open_to_network: Open = False,
) -> None:
    """Run a router alone, until Ctrl-C. For this machine only, unless options say otherwise."""
    from hmcs.bus.router import main as run_router

    words = ["--listen", listen] if listen else []
    words += ["--config", str(config)] if config else []
    words += ["--open-to-network"] if open_to_network else []
    raise typer.Exit(run_router(words))


_OWN_VARIABLES = frozenset(
    {"HMCS_ROUTER", "HMCS_CELL", "HMCS_SECURE", "HMCS_OPEN_TO_NETWORK", "HMCS_INSTANCE"}
)
"""Read by commands, not by services."""


def _one_task(argument: str | None, option: str | None) -> str | None:
    if argument is not None and option is not None:
        raise UserError(f"--task {option}: the task {argument} is given already: name one of them")
    return argument or option


def _scale(item: str) -> tuple[str, int]:
    name, _, count = item.partition("=")
    if not count.isdecimal():
        raise UserError(f"--scale {item}: write SERVICE=N, e.g. gesteme-classifier=3")
    return name, int(count)


_STYLES = ("cyan", "green", "magenta", "yellow", "blue", "bright_cyan", "bright_green")


def _line(who: str, what: str) -> Text:
    style = "bold" if who == "hmcs" else _STYLES[sum(who.encode()) % len(_STYLES)]
    head = f"{who:22} | "
    return Text.assemble((head, style), what.replace("\n", f"\n{'':22} | "))
