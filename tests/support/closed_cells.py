"""Closed cells of a test's own."""

from __future__ import annotations

from pathlib import Path

from hmcs.bus.rights import roles
from hmcs_secure.authority import create_authority, issue, utc_now
from hmcs_secure.closed_cell import ClosedCell
from hmcs_secure.identity import ROUTER, Identity


def new_closed_cell(folder: Path, cell: str, *, signed_models: bool = False) -> ClosedCell:
    """Make the certificates of every role of a cell, and of its router."""
    now = utc_now()
    authority = create_authority(folder / cell, cell, now)
    for role in (*roles(), ROUTER):
        issue(authority, Identity(cell, role), now)
    return ClosedCell(authority, signed_models)
