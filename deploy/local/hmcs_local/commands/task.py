"""Work with task files: `new`, `task check`."""

from __future__ import annotations

from typing import Annotated

import typer

from hmcs.errors import UserError
from hmcs_local.commands.options import Folder, note
from hmcs_local.new_task import PLACES, PLANES, STATES, task_name_of, write_new_task
from hmcs_local.stack import DEFAULT_FOLDER


def new(
    name: Annotated[str, typer.Argument(help="Of the task, or its file; NAME.yaml is written.")],
    states: Annotated[
        str, typer.Option(metavar="A,B,…", help="Parts of the task, in their order.")
    ] = ",".join(STATES),
    robot: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE.urdf", help=f"Which arm: {', '.join(PLACES)}, or one of your own."
        ),
    ] = "puma560",
    tool_link: Annotated[
        str | None,
        typer.Option(metavar="LINK", help="Of your arm, whose frame is the tool frame."),
    ] = None,
    plane: Annotated[
        str | None,
        typer.Option(metavar="PLANE", help="The motion lies in a plane: xy, xz or yz."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
) -> None:
    """Write a task file to begin with, every field explained; nothing is asked.

    `hmcs up NAME.yaml` then brings the stack up to teach it on the page.
    """
    file = task_name_of(name)
    parts = [part.strip() for part in states.split(",") if part.strip()]
    if not parts:
        raise UserError("--states: name one at least, e.g. --states approach,insert,retract")
    chosen = next((each for each in PLANES if each == plane), None)
    if plane is not None and chosen is None:
        raise UserError(f"--plane {plane}: expected one of {', '.join(PLANES)}")
    write_new_task(file, parts, robot, chosen, tool_link=tool_link, force=force)
    typer.echo(f"{file}: a task of {len(parts)} states; bring it up with `hmcs up {file}`")


def check(
    file: Annotated[str, typer.Argument(help="A task file, or a shipped task's name.")],
    demonstrations: Annotated[
        list[str] | None,
        typer.Argument(
            help="CSV files, recordings, lasa:SHAPE/NUMBER: whether they fit it and agree."
        ),
    ] = None,
    folder: Folder = DEFAULT_FOLDER,
) -> None:
    """Name every problem of a task file, with line and field; exit code 2 where there is one.

    Demonstrations are judged as by `hmcs train`: what it would refuse ends with exit code 2.
    """
    from hmcs.fixtures.regions.workspace import check_workspace
    from hmcs.task import load_task
    from hmcs_local.demonstration_files import expanded
    from hmcs_local.robots import check_own_robot
    from hmcs_trainer.training import checked

    task = load_task(file)
    check_workspace(file, task)
    for line in check_own_robot(task):
        typer.echo(line)
    shown = ""
    if demonstrations:
        count, findings = checked(task, expanded(demonstrations, folder, note), typer.echo)
        shown = f"; {count} demonstrations agree" + (
            ", apart from the findings above" if findings else ""
        )
    counts = f"{len(task.gestemes)} gestemes, {len(task.states)} states"
    typer.echo(f"{file}: in order: {counts}{shown}")
