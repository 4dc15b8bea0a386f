"""Options that several commands share, and how NAME=VALUE is read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hmcs.errors import UserError

if TYPE_CHECKING:
    from hmcs.recordings.foreign.choices import Choices

Router = Annotated[
    str, typer.Option(envvar="HMCS_ROUTER", metavar="ENDPOINT", help="Where the router is.")
]
Cell = Annotated[
    str, typer.Option(envvar="HMCS_CELL", metavar="NAME", help="Which operator and robot.")
]
Secure = Annotated[
    str | None,
    typer.Option(
        envvar="HMCS_SECURE",
        metavar="CELL",
        help="The closed cell of this name, or the folder of its certificates, see `hmcs secure`; "
        "in place of --cell.",
    ),
]
Open = Annotated[
    bool,
    typer.Option(
        "--open-to-network",
        envvar="HMCS_OPEN_TO_NETWORK",
        help="Let the router listen beyond this machine without TLS: everybody who reaches its "
        "port can move the robot.",
    ),
]
Folder = Annotated[
    Path, typer.Option(metavar="DIR", help="Where `hmcs up` keeps logs, models and recordings.")
]


def note(line: str) -> None:
    """Say on standard error what a name was taken for."""
    typer.echo(line, err=True)


Topics = Annotated[
    list[str] | None,
    typer.Option(
        "--topic",
        metavar="NAME",
        help="What to read of a bag or an MCAP file: the motion, the force, the buttons; a feature "
        "of a LeRobot data set. May be repeated. What is the only one of its kind is found.",
    ),
]
Columns = Annotated[
    str,
    typer.Option(
        metavar="ROLE=NAME,…",
        help="Columns of a CSV file with other names, or numbers of a feature: time=stamp,x=tcp_x. "
        "Roles: time x y z qx qy qz qw fx fy fz tx ty tz state.",
    ),
]
Units = Annotated[
    list[str] | None,
    typer.Option(
        "--unit",
        metavar="m|cm|mm|um|in|rad|deg",
        help="Of positions; of joint positions, rad or deg.",
    ),
]
Times = Annotated[
    str, typer.Option("--time", metavar="s|ms|us|ns|iso", help="Unit of a CSV file's times.")
]
Urdf = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="The robot whose joint positions were recorded."),
]
Link = Annotated[str, typer.Option(metavar="LINK", help="Of it, that is the tool.")]
Marks = Annotated[
    str,
    typer.Option(
        metavar="BUTTON=STATE,…",
        help="States that begin where a joystick's button is pressed: 0=approach,1=insert.",
    ),
]


def file_choices(
    topics: list[str] | None,
    columns: str,
    units: list[str] | None,
    time: str,
    urdf: Path | None,
    link: str,
    marks: str,
) -> Choices:
    """Return how files of other programs are read, of the options above; see `choices_of`."""
    from hmcs.recordings.foreign.choices import choices_of

    return choices_of(
        topics=topics or (),
        columns=columns,
        units=units or (),
        time=time,
        urdf=urdf,
        link=link,
        marks=marks,
    )


def setting(item: str) -> tuple[str, str]:
    """Split NAME=VALUE, and raise UserError where it is not of this form."""
    name, equals, value = item.partition("=")
    if not (name and equals):
        raise UserError(f"--set {item}: write NAME=VALUE, e.g. temperature=3")
    return name, value
