"""Options that several commands share, and how NAME=VALUE is read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hmcs.errors import UserError

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


def setting(item: str) -> tuple[str, str]:
    """Split NAME=VALUE, and raise UserError where it is not of this form."""
    name, equals, value = item.partition("=")
    if not (name and equals):
        raise UserError(f"--set {item}: write NAME=VALUE, e.g. temperature=3")
    return name, value
