"""Which recognizer runs and which the fixture follows: `recognizers`, `swap`, `deploy`."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from hmcs.bus.config import DEFAULT_ROUTER
from hmcs.errors import UserError
from hmcs_local.commands.options import Cell, Folder, Router, Secure
from hmcs_local.stack import DEFAULT_FOLDER
from hmcs_local.tables import screen


def recognizers(
    name: Annotated[
        str | None, typer.Argument(help="Show this one with its settings and their defaults.")
    ] = None,
) -> None:
    """List the recognizers a model can be learned for, with a line and the source of each."""
    from hmcs.recognition.registry import kind_named, kinds
    from hmcs_local.recognizers import show_kind, show_kinds

    if name is None:
        show_kinds(kinds(), screen())
    else:
        show_kind(kind_named(name), screen())


def swap(
    instance: Annotated[
        str | None,
        typer.Argument(help="The gesteme classifier to replace, as `hmcs status` names it."),
    ] = None,
    command: Annotated[
        str,
        typer.Option("--with", metavar="COMMAND", help="What to start in its place."),
    ] = "",
    activate: Annotated[
        str, typer.Option(metavar="MODEL", help="The recognizer the fixture is to follow.")
    ] = "",
    load: Annotated[
        str,
        typer.Option(
            metavar="FILE", help="Its model file, where the fixture controller does not have it."
        ),
    ] = "",
    router: Router = DEFAULT_ROUTER,
    cell: Cell = "demo",
    secure: Secure = None,
    folder: Folder = DEFAULT_FOLDER,
) -> None:
    """Replace a classifier, or activate another recognizer, while the stack runs.

    `hmcs swap gesteme-classifier-1` starts a fresh classifier (another program with --with), waits
    until it has replayed the last steps and is ready, and only then stops the old one: no step
    goes without evidence. If the newcomer is not ready within 10 s, it is stopped and the old one
    goes on. Both belong to the `hmcs up` of --folder.

    `hmcs swap --activate MODEL` lets the fixture follow the belief of another recognizer that runs
    already, in the shadow of the active one. The exit code is 1 where only some fixtures answer.
    """
    from hmcs_local import swap as swapping
    from hmcs_local.connecting import open_operator
    from hmcs_local.control import Control
    from hmcs_local.interrupts import interruptible

    if bool(instance) == bool(activate) or (command and not instance) or (load and instance):
        raise UserError("name either a classifier to replace or a model to --activate")
    control = Control(folder)
    if instance:
        control.check_there()
    with interruptible(), open_operator(router, cell, secure) as bus:
        if instance:
            swapping.replace_classifier(
                bus, control, instance, command=shlex.split(command), tell=typer.echo
            )
            return
        partly = False
        for change, what in ((swapping.load, load), (swapping.activate, activate)):
            try:
                if what:
                    typer.echo(change(bus, what))
            except swapping.PartlySwappedError as error:
                typer.echo(error, err=True)
                partly = True
    raise typer.Exit(int(partly))


def deploy(
    model: Annotated[
        Path | None, typer.Argument(help="The model file whose recognizer is to take over.")
    ] = None,
    back: Annotated[
        bool, typer.Option("--back", help="Return to the model that was active before.")
    ] = False,
    watch_s: Annotated[
        float,
        typer.Option("--watch-s", min=0.0, metavar="S", help="So long it is compared as a shadow."),
    ] = 5.0,
    router: Router = DEFAULT_ROUTER,
    cell: Cell = "demo",
    secure: Secure = None,
    folder: Folder = DEFAULT_FOLDER,
) -> None:
    """Let a newly trained model take over while the operator moves, or return to the one before.

    Its recognizer comes up as a shadow of the active one, replays the last steps, is compared with
    it for a while, and is activated; the old one leaves then. All of it belongs to the `hmcs up` of
    --folder.
    """
    from hmcs.recognition.model_file import load_model
    from hmcs_local import deploying
    from hmcs_local.connecting import open_operator
    from hmcs_local.control import Control
    from hmcs_local.interrupts import interruptible
    from hmcs_local.swap import PartlySwappedError

    if (model is None) != back:
        raise UserError("name either a model file or --back")
    if model is not None:
        # What is wrong with it is known before anybody is asked.
        load_model(model)
    control = Control(folder)
    control.check_there()
    with interruptible(), open_operator(router, cell, secure) as bus:
        try:
            if model is None:
                typer.echo(f"back to {deploying.back(bus, control, folder, typer.echo)}")
            else:
                deploying.deploy(bus, control, folder, model, watch_s=watch_s, tell=typer.echo)
        except PartlySwappedError as error:
            typer.echo(f"what was active before goes on, too: {error}", err=True)
            raise typer.Exit(1) from None
