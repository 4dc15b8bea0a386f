"""Libraries of peers: imported when a method of theirs is used, and asked for when missing."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from hmcs.errors import UserError


def installed(library: str) -> bool:
    """Return whether a peer's library can be imported."""
    return find_spec(library) is not None


def peer(module: str) -> Any:
    """Return a module of a peer's library; raises UserError where it is not installed."""
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if error.name and not module.startswith(error.name):
            raise
        library = module.partition(".")[0]
        raise UserError(
            f"{library} is not installed: `make peers` installs all peers, or leave "
            "its methods out with --set methods=NAME,NAME"
        ) from error
