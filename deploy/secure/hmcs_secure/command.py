"""`hmcs secure …`: make a closed cell, and keep its certificates."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from hmcs.bus.keys import check_name
from hmcs.bus.rights import roles
from hmcs.write_places import check_file_place
from hmcs_secure.authority import (
    HOLDER_DAYS,
    Authority,
    AuthorityError,
    Holder,
    create_authority,
    holders_of,
    issue,
    open_authority,
    readable_by_others,
    utc_now,
)
from hmcs_secure.closed_cell import DEFAULT_FOLDER
from hmcs_secure.containers import open_to_containers
from hmcs_secure.identity import ROUTER, Identity
from hmcs_secure.router_file import DEFAULT_LISTEN, write_router_file

RENEW_DAYS = 30
"""A certificate with fewer days left is to be renewed."""

app = typer.Typer(
    help="Close a cell: certificates of its own, and a router that refuses everybody else.",
    no_args_is_help=True,
)

_Cell = Annotated[str, typer.Argument(help="Name of the cell.", metavar="CELL")]
_Folder = Annotated[
    Path,
    typer.Option(
        "--folder", metavar="DIR", help="Where cells keep their certificates, a folder each."
    ),
]
_Hosts = Annotated[
    list[str] | None,
    typer.Option(
        "--host", metavar="NAME", help="A name or address the router is reached by; repeatable."
    ),
]


@app.command()
def init(cell: _Cell, folder: _Folder = DEFAULT_FOLDER, host: _Hosts = None) -> None:
    """Make a certificate authority for CELL, and a certificate for every role and the router."""
    check_name("cell", cell)
    now = utc_now()
    authority = create_authority(folder / cell, cell, now)
    for role in (*roles(), ROUTER):
        issue(authority, Identity(cell, role), now, hosts=host or () if role == ROUTER else ())
    file = write_router_file(authority, authority.folder / "router.json5")
    console = Console(highlight=False, soft_wrap=True)
    console.print(f"{authority.folder}: the authority of cell {cell}, and its certificates")
    console.print(f"{file}: the router's configuration")
    console.print(
        f"Keep {authority.folder / 'ca.key'} where nobody else comes: who has it can be "
        f"anybody. Start the stack with `hmcs up --secure {authority.folder}`."
    )


@app.command("issue")
def issue_command(
    cell: _Cell,
    service: Annotated[str, typer.Argument(help=f"One of {', '.join((*roles(), ROUTER))}.")],
    instance: Annotated[
        str,
        typer.Option(metavar="NAME", help="Bind the certificate to one instance's keys."),
    ] = "",
    host: _Hosts = None,
    days: Annotated[int, typer.Option(min=1, max=3650, help="How long it is valid.")] = HOLDER_DAYS,
    folder: _Folder = DEFAULT_FOLDER,
) -> None:
    """Issue a certificate, anew where there is one, and bring the router's rules up to date."""
    authority = _authority(folder, cell)
    identity = Identity(cell, service, instance)
    holder = issue(authority, identity, utc_now(), hosts=host or (), days=days)
    write_router_file(authority, authority.folder / "router.json5")
    Console(highlight=False, soft_wrap=True).print(
        f"{holder.certificate}: {identity.common_name}, until {holder.valid_until:%Y-%m-%d}. "
        "Start the router anew, so that it knows it"
    )


@app.command()
def router(
    cell: _Cell,
    output: Annotated[
        Path | None, typer.Option(metavar="FILE", help="By default router.json5 of the cell.")
    ] = None,
    listen: Annotated[
        str,
        typer.Option(
            metavar="ENDPOINT",
            help="Where it listens; tls/0.0.0.0:7447 can be reached from other hosts, by holders "
            "of certificates alone.",
        ),
    ] = DEFAULT_LISTEN,
    connect: Annotated[
        list[str] | None,
        typer.Option(metavar="ENDPOINT", help="Another router of the cell; repeatable."),
    ] = None,
    instance: Annotated[
        str, typer.Option(metavar="NAME", help="Which router, where a cell has several.")
    ] = "",
    files: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Where the router finds the certificates, if elsewhere."),
    ] = None,
    folder: _Folder = DEFAULT_FOLDER,
) -> None:
    """Write a router's configuration: mutual TLS, default deny, the rules of every certificate."""
    if output is not None:
        check_file_place(output, "--output")
    authority = _authority(folder, cell)
    target = output or authority.folder / "router.json5"
    written = write_router_file(
        authority, target, listen=listen, connect=connect or (), instance=instance, files=files
    )
    Console(highlight=False, soft_wrap=True).print(f"{written}: listens on {listen}")


@app.command()
def containers(cell: _Cell, folder: _Folder = DEFAULT_FOLDER) -> None:
    """Let the containers of compose.secure.yaml use CELL; again after certificates were issued."""
    authority = _authority(folder, cell)
    written = open_to_containers(authority, utc_now())
    Console(highlight=False, soft_wrap=True).print(
        f"{written}: the router's configuration in its container. Start the stack with "
        f"`HMCS_CELL={cell} HMCS_SECURE={authority.folder.resolve()} docker compose "
        "--file compose.yaml --file compose.secure.yaml up`"
    )


@app.command()
def check(
    cell: _Cell,
    within_days: Annotated[
        int, typer.Option(min=0, help="Tell certificates with fewer days left.")
    ] = RENEW_DAYS,
    folder: _Folder = DEFAULT_FOLDER,
) -> None:
    """Show every certificate and until when it is valid; exit code 1 where something is to do."""
    authority, now = _authority(folder, cell), utc_now()
    holders = holders_of(authority)
    table = Table()
    for column in ("holder", "valid until", "days left", "to do"):
        table.add_column(column, overflow="fold")
    problems = 0
    for holder in holders:
        to_do = _to_do(holder, holder.days_left(now), within_days)
        problems += bool(to_do)
        table.add_row(
            holder.identity.common_name,
            f"{holder.valid_until:%Y-%m-%d}",
            str(holder.days_left(now)),
            to_do,
        )
    console = Console(highlight=False)
    console.print(table)
    for key in (authority.folder / "ca.key", authority.model_signing_key):
        if key.exists() and readable_by_others(key):
            problems += 1
            console.print(f"{key}: others may read it: `chmod 600 {key}`")
    if (authority.valid_until - now).days < within_days:
        problems += 1
        console.print(
            f"the authority expires on {authority.valid_until:%Y-%m-%d}: make a new cell in time"
        )
    raise typer.Exit(1 if problems else 0)


@app.command()
def renew(
    cell: _Cell,
    within_days: Annotated[
        int, typer.Option(min=0, help="Renew certificates with fewer days left.")
    ] = RENEW_DAYS,
    folder: _Folder = DEFAULT_FOLDER,
) -> None:
    """Issue anew what expires soon; holders and hosts stay."""
    authority, now = _authority(folder, cell), utc_now()
    console = Console(highlight=False, soft_wrap=True)
    due = [h for h in holders_of(authority) if h.days_left(now) < within_days]
    for holder in due:
        fresh = issue(authority, holder.identity, now, hosts=holder.hosts)
        console.print(f"{fresh.certificate}: until {fresh.valid_until:%Y-%m-%d}")
    if not due:
        console.print(f"no certificate of {cell} expires within {within_days} days")


@app.command()
def sign(
    cell: _Cell,
    models: Annotated[list[Path], typer.Argument(metavar="MODEL…", help="Model files.")],
    folder: _Folder = DEFAULT_FOLDER,
) -> None:
    """Sign model files, so that a cell that requires it loads them."""
    from hmcs.model_signing import sign_model

    authority = _authority(folder, cell)
    console = Console(highlight=False, soft_wrap=True)
    for model in models:
        console.print(f"{sign_model(model, authority.model_signing_key)}: the signature of {model}")


def _authority(folder: Path, cell: str) -> Authority:
    check_name("cell", cell)
    authority = open_authority(folder / cell)
    if authority.cell != cell:
        raise AuthorityError(f"{authority.folder}: is the authority of cell {authority.cell!r}")
    return authority


def _to_do(holder: Holder, days_left: int, within_days: int) -> str:
    if not holder.key.exists():
        return "its key is elsewhere"
    if readable_by_others(holder.key):
        return f"others may read its key: `chmod 600 {holder.key}`"
    if days_left < 0:
        return "has expired: `hmcs secure renew`"
    if days_left < within_days:
        return "expires soon: `hmcs secure renew`"
    return ""
