"""A closed cell of a test's own: certificates in a folder, and a real router with mutual TLS."""

from __future__ import annotations

import contextlib
import json
import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import zenoh

from hmcs.bus.rights import roles
from hmcs_secure.authority import Authority, Holder, create_authority, issue, utc_now
from hmcs_secure.identity import ROUTER, Identity
from hmcs_secure.router_file import router_configuration

CELL = "closed"


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


class ClosedCell:
    """A cell with all its certificates and a running router."""

    def __init__(self, folder: Path, stack: contextlib.ExitStack) -> None:
        now = utc_now()
        self.authority = create_authority(folder / CELL, CELL, now)
        self.holders = {
            role: issue(self.authority, Identity(CELL, role), now) for role in (*roles(), ROUTER)
        }
        self.bound = issue(self.authority, Identity(CELL, "gesteme_classifier", "one"), now)
        self.endpoint = f"tls/localhost:{free_port()}"
        self._stack = stack
        configuration = router_configuration(
            self.authority,
            self.holders[ROUTER],
            [*self.holders.values(), self.bound],
            listen=self.endpoint,
        )
        router = zenoh.open(zenoh.Config.from_json5(json.dumps(configuration)))
        stack.enter_context(router)

    def open(self, role: str) -> zenoh.Session:
        """Open a session with the certificate of a role."""
        return self.open_with(self.authority, self.holders[role])

    def open_with(self, authority: Authority, holder: Holder | None, **other: Any) -> zenoh.Session:
        """Open a session that trusts an authority and shows a certificate, or none."""
        tls: dict[str, Any] = {
            "root_ca_certificate": str(authority.certificate), "verify_name_on_connect": True
        }  # fmt: skip
        if holder is not None:
            tls |= {
                "connect_certificate": str(holder.certificate),
                "connect_private_key": str(holder.key),
                "enable_mtls": True,
            }
        configuration = {
            "mode": "client",
            "connect": {"endpoints": [self.endpoint], "timeout_ms": 3000, "exit_on_failure": True},
            "scouting": {"multicast": {"enabled": False}},
            "transport": {"link": {"tls": tls}},
        } | other
        session = zenoh.open(zenoh.Config.from_json5(json.dumps(configuration)))
        return self._stack.enter_context(session)


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ClosedCell]:
    with contextlib.ExitStack() as stack:
        yield ClosedCell(tmp_path_factory.mktemp("secure"), stack)


@pytest.fixture
def authority(tmp_path: Path) -> Callable[..., Authority]:
    """Make an authority of a cell in a folder of its own."""
    return lambda name=CELL, now=None: create_authority(tmp_path / name, name, now or utc_now())
