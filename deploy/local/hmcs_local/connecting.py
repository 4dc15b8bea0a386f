"""A place on the bus for commands: to look, or to act for the operator."""

from __future__ import annotations

import logging
import os
from typing import Any, NamedTuple

from pydantic import ValidationError

from hmcs.bus.config import DEFAULT_ROUTER, BusSettings, tls_files
from hmcs.bus.keys import KeyNameError
from hmcs.bus.rights import OBSERVER, OPERATOR, rights_of
from hmcs.bus.session import Bus
from hmcs.errors import UserError
from hmcs_secure.closed_cell import find_closed_cell
from hmcs_secure.router_file import DEFAULT_LISTEN

_CONNECT_TIMEOUT_S = 3.0


class Reached(NamedTuple):
    """How a process of a role reaches its cell."""

    router: str
    cell: str
    tls: dict[str, Any]
    """The settings tls_ca, tls_certificate and tls_key; empty for a cell without certificates."""


def reached(role: str, router: str, cell: str, secure: str | None) -> Reached:
    """Return how a process of a role reaches a cell.

    `secure` is the name or the folder of a closed cell, in place of `cell`; certificates that lie
    elsewhere are named by HMCS_TLS_CA, HMCS_TLS_CERTIFICATE and HMCS_TLS_KEY. Raises AuthorityError
    where the closed cell has no certificate of the role.
    """
    if not secure:
        return Reached(router, cell, dict(tls_files(os.environ)))
    closed = find_closed_cell(secure)
    router = DEFAULT_LISTEN if router == DEFAULT_ROUTER else router
    return Reached(router, closed.name, closed.credentials(role)._asdict())


def open_observer(router: str, cell: str, secure: str | None = None) -> Bus:
    """Join a cell to look at it; see `reached`."""
    return _join(OBSERVER, router, cell, secure)


def open_operator(router: str, cell: str, secure: str | None = None) -> Bus:
    """Join a cell to act for its operator; see `reached`."""
    return _join(OPERATOR, router, cell, secure)


def _join(role: str, router: str, cell: str, secure: str | None) -> Bus:
    """Join a cell with the rights of a role.

    Raises UserError where there is no router, and for names and certificates that cannot be used.
    """
    to = reached(role, router, cell, secure)
    try:
        settings = BusSettings(
            router=to.router, cell=to.cell, connect_timeout_s=_CONNECT_TIMEOUT_S, **to.tls
        )
    except (ValidationError, KeyNameError) as error:
        reason = error.errors()[0]["msg"] if isinstance(error, ValidationError) else str(error)
        raise UserError(reason) from None
    quiet = logging.Logger(role)
    quiet.addHandler(logging.NullHandler())
    bus = Bus.open(settings, role, f"pid-{os.getpid()}", log=quiet)
    bus.rights = rights_of(role, bus.keys)
    return bus
