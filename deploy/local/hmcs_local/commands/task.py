"""Work with task files: `task check`."""

from __future__ import annotations

from typing import Annotated

import typer


def check(
    file: Annotated[str, typer.Argument(help="A task file, or a shipped task's name.")],
    demonstrations: Annotated[
        list[str] | None,
        typer.Argument(help="CSV files, or lasa:SHAPE/NUMBER: whether they fit it and agree."),
    ] = None,
) -> None:
    """Name every problem of a task file, with line and field; exit code 2 where there is one.

    Demonstrations are judged as by `hmcs train`: what it would refuse ends with exit code 2.
    """
    from hmcs.fixtures.regions.workspace import check_workspace
    from hmcs.task import load_task
    from hmcs_trainer.training import checked

    task = load_task(file)
    check_workspace(file, task)
    shown = ""
    if demonstrations:
        count, findings = checked(task, demonstrations, typer.echo)
        shown = f"; {count} demonstrations agree" + (
            ", apart from the findings above" if findings else ""
        )
    counts = f"{len(task.gestemes)} gestemes, {len(task.states)} states"
    typer.echo(f"{file}: in order: {counts}{shown}")
