"""A closed cell as the containers of compose.secure.yaml see it."""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path

from hmcs_secure.authority import Authority, AuthorityError, holders_of, issue
from hmcs_secure.identity import ROUTER
from hmcs_secure.router_file import write_router_file

USER_ID = 10001
"""Who the processes in the containers run as, see deploy/Dockerfile."""
ROUTER_HOST = "router"
"""What the other containers reach the router by."""
LISTEN = "tls/0.0.0.0:7447"
"""The network of a container is its own: compose.yaml says who reaches it from outside."""
MOUNTED = Path("/secure")
"""Where the files of a cell are in a container."""


def open_to_containers(authority: Authority, now: datetime) -> Path:
    """Name the router as its container is named, and hand the keys to the containers' user.

    Returns the router's configuration for its container. Raises AuthorityError where the router
    has no certificate, or the keys cannot be handed over: only root may.
    """
    router = next((h for h in holders_of(authority) if h.identity.role == ROUTER), None)
    if router is not None and ROUTER_HOST not in router.hosts:
        issue(authority, router.identity, now, hosts=(*router.hosts, ROUTER_HOST))
    target = write_router_file(
        authority, authority.folder / "router.containers.json5", listen=LISTEN, files=MOUNTED
    )
    for holder in holders_of(authority):
        if not holder.key.exists() or holder.key.stat().st_uid == USER_ID:
            continue
        try:
            os.chown(holder.key, USER_ID, -1)
        except PermissionError as error:
            raise AuthorityError(
                f"{holder.key}: only its owner reads it, and the containers run as user {USER_ID}: "
                "run this as root, which hands the keys over to them"
            ) from error
    return target
