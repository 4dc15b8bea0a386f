"""The configuration of a closed cell's router: mutual TLS, default deny, the rules of the table."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hmcs.bus.config import LINK_OPTIONS, UNICAST_OPTIONS
from hmcs.whole_files import written_whole
from hmcs_secure.access import access_control, size_limits
from hmcs_secure.authority import Authority, AuthorityError, Holder, holders_of
from hmcs_secure.identity import ROUTER

DEFAULT_LISTEN = "tls/127.0.0.1:7447"


def router_configuration(
    authority: Authority,
    router: Holder,
    holders: Sequence[Holder],
    *,
    listen: str = DEFAULT_LISTEN,
    connect: Sequence[str] = (),
    files: Path | None = None,
) -> dict[str, Any]:
    """Return the Zenoh configuration of one router of a cell.

    `connect` are other routers of the cell; `files` is where the certificates are for the router,
    where that is another folder than here, as in a container.
    """
    folder = authority.folder if files is None else files

    def there(path: Path) -> str:
        return str(folder / path.relative_to(authority.folder))

    credentials = {
        "root_ca_certificate": there(authority.certificate),
        "listen_certificate": there(router.certificate),
        "listen_private_key": there(router.key),
        "connect_certificate": there(router.certificate),
        "connect_private_key": there(router.key),
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,
    }
    return {
        "mode": "router",
        "listen": {"endpoints": [listen], "exit_on_failure": True},
        "connect": {
            "endpoints": list(connect),
            "exit_on_failure": False,
            "timeout_ms": -1,
            "retry": {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2},
        },
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}, "delay": 0},
        "transport": {
            "unicast": UNICAST_OPTIONS,
            "link": {"tx": LINK_OPTIONS, "protocols": ["tls"], "tls": credentials},
        },
        "access_control": access_control([h.identity for h in holders]),
        "low_pass_filter": size_limits(authority.cell),
    }


def write_router_file(
    authority: Authority,
    target: Path,
    *,
    listen: str = DEFAULT_LISTEN,
    connect: Sequence[str] = (),
    instance: str = "",
    files: Path | None = None,
) -> Path:
    """Write a router's json5 file from the certificates there are; return it.

    Raises AuthorityError where the router has no certificate yet.
    """
    holders = holders_of(authority)
    router = next(
        (h for h in holders if (h.identity.role, h.identity.instance) == (ROUTER, instance)), None
    )
    if router is None:
        asked = f" --instance {instance}" if instance else ""
        raise AuthorityError(
            f"{authority.folder}: the router has no certificate: "
            f"`hmcs secure issue {authority.cell} router{asked}` makes one"
        )
    made = router_configuration(
        authority, router, holders, listen=listen, connect=connect, files=files
    )
    head = (
        f"// The router of the closed cell {authority.cell}: made by `hmcs secure router`, again\n"
        "// after each certificate that is issued with an instance.\n"
    )
    with written_whole(target) as unfinished:
        unfinished.write_text(head + json.dumps(made, indent=2) + "\n", encoding="utf-8")
    return target
