"""Look at robots: `robot check`, `robot list`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hmcs_local.tables import screen


def check(
    file: Annotated[
        str, typer.Argument(help="A URDF, a task file, or the name of a robot that comes along.")
    ],
    tool_link: Annotated[
        str | None, typer.Option(metavar="LINK", help="Its frame is the tool frame.")
    ] = None,
    base_link: Annotated[
        str | None, typer.Option(metavar="LINK", help="Its frame is the base frame.")
    ] = None,
    package_path: Annotated[
        list[Path] | None,
        typer.Option(metavar="FOLDER", help="Holds packages that `package://` names; repeatable."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the arm: .png, .svg or .pdf.")
    ] = None,
) -> None:
    """Show an arm's joints, limits, reach and postures, and what its file leaves out.

    The exit code is 2 where the arm cannot be used, with the line of the file.
    """
    from hmcs_local.robots import check_robot

    check_robot(file, tool_link, base_link, tuple(package_path or ()), output, screen())


def list_robots() -> None:
    """Name the robots that come along, as a task file names them."""
    from hmcs_local.robots import show_robots

    show_robots(screen())
