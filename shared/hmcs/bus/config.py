"""How sessions are set up: every Zenoh option that is not its default stands here.

Nothing listens beyond this machine unless it is asked to: who reaches a listening port without TLS
can move the robot.
"""

from __future__ import annotations

import ipaddress
import json
import re
from pathlib import Path
from typing import Any, Protocol, Self

import zenoh
from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from hmcs.bus.keys import check_name
from hmcs.errors import UserError

DEFAULT_ROUTER = "tcp/127.0.0.1:7447"
LEASE_MS = 1000
"""How long a silent session counts as alive; it is announced by the side that may fall silent."""
WAIT_BEFORE_DROP_US = 50_000
"""How long a full queue holds a message back before it is dropped: bursts pass without a loss."""
OPENING_MS = 5000
"""How long one attempt to reach a router may take: it is enough for a round trip of 1.5 s."""
ACCEPTING_MS = 3000
"""How long a router waits for a connection to introduce itself; a silent one is closed then."""
ACCEPTING_AT_ONCE = 4096
"""Connections a router waits for at a time. Of more than that a new session finds no place: 100,
Zenoh's default, are silenced by as many idle connections of anybody."""
OPEN_TO_NETWORK = "--open-to-network, or HMCS_OPEN_TO_NETWORK=true"
"""How a user asks for listening beyond this machine."""

_LOOPBACK = "tcp/127.0.0.1:0"
_EVERYWHERE = "tcp/[::]:0"
_ENCRYPTED = ("tls", "quic")
_WITHIN_THIS_MACHINE = ("unixsock-stream", "unixpipe")

_ENDPOINT = re.compile(r"[a-z][a-z0-9-]*/.+")


class BusSettings(BaseModel):
    """How a process reaches the others of its cell."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True
    )

    router: str = DEFAULT_ROUTER
    """Endpoint of the router, e.g. `tcp/127.0.0.1:7447`."""
    cell: str = "demo"
    """One operator with one robot; cells on one router do not see each other."""
    direct: bool = False
    """Talk to the other direct processes without the router's hop, once it has introduced them."""
    open_to_network: bool = False
    """Let a direct process be reached from other hosts, too. There is no encryption and no
    password: everybody who reaches its port can move the robot."""
    tls_ca: Path | None = None
    """Certificate of the cell's authority (PEM): the router has to hold one of its certificates."""
    tls_certificate: Path | None = None
    """This process' own certificate (PEM), which the router asks for."""
    tls_key: Path | None = None
    """The private key of that certificate (PEM)."""
    connect_timeout_s: float | None = Field(default=None, gt=0)
    """How long to wait for a router; None waits for ever."""

    @model_validator(mode="after")
    def _tls_is_whole(self) -> Self:
        check_tls(self)
        return self

    @field_validator("router")
    @classmethod
    def _router_is_an_endpoint(cls, router: str) -> str:
        return check_endpoint(router)

    @field_validator("cell")
    @classmethod
    def _cell_is_a_chunk(cls, cell: str) -> str:
        return check_name("cell", cell)


def check_endpoint(endpoint: str) -> str:
    """Return `endpoint` if it reads `protocol/address`; raises ValueError otherwise."""
    if not _ENDPOINT.fullmatch(endpoint):
        raise ValueError(
            f"{endpoint!r} is no endpoint: use protocol/address:port, e.g. {DEFAULT_ROUTER}"
        )
    return endpoint


class TlsSettings(Protocol):
    """Settings of whatever opens a session."""

    @property
    def router(self) -> str: ...  # noqa: D102
    @property
    def direct(self) -> bool: ...  # noqa: D102
    @property
    def tls_ca(self) -> Path | None: ...  # noqa: D102
    @property
    def tls_certificate(self) -> Path | None: ...  # noqa: D102
    @property
    def tls_key(self) -> Path | None: ...  # noqa: D102


def check_tls(settings: TlsSettings) -> None:
    """Raise ValueError for settings of TLS that are not whole or contradict each other."""
    files = {
        "tls_ca": settings.tls_ca,
        "tls_certificate": settings.tls_certificate,
        "tls_key": settings.tls_key,
    }
    missing = [name for name, file in files.items() if file is None]
    if len(missing) == len(files):
        if settings.router.startswith("tls/"):
            raise ValueError(f"{settings.router} wants tls_ca, tls_certificate and tls_key")
        return
    if missing:
        raise ValueError(
            f"{', '.join(missing)} missing: a closed cell needs all of {', '.join(files)}"
        )
    if not settings.router.startswith("tls/"):
        raise ValueError(
            f"router is {settings.router}, expected tls/HOST:PORT: certificates are given"
        )
    if settings.direct:
        raise ValueError(
            "direct: processes that talk past the router talk past its rules; leave it out in a "
            "closed cell"
        )
    for name, file in files.items():
        if file is not None and not file.is_file():
            raise ValueError(f"{name}: no such file: {file}")


def opens_to_network(endpoint: str) -> bool:
    """Return whether who listens on `endpoint` can be reached from other hosts without TLS."""
    return endpoint.partition("/")[0] not in _ENCRYPTED and not on_this_machine(endpoint)


def on_this_machine(endpoint: str) -> bool:
    """Return whether only processes of this machine reach `endpoint`.

    No name but `localhost` counts as this machine: what it stands for may change.
    """
    protocol, _, rest = endpoint.partition("/")
    if protocol in _WITHIN_THIS_MACHINE:
        return True
    host = re.split(r"[?#]", rest)[0].rpartition(":")[0].removeprefix("[").removesuffix("]")
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def client_config(settings: BusSettings) -> zenoh.Config:
    """Return the configuration of a session that tries once to reach the router.

    The attempt ends at once where nobody listens, and after `OPENING_MS` where nobody answers. Once
    open the session reconnects by itself for ever, 50 to 250 ms apart.
    Raises UserError for a direct process that others would not hear: a router does not pass on what
    direct processes say to each other.
    """
    if settings.direct and not (settings.open_to_network or on_this_machine(settings.router)):
        raise UserError(
            f"direct: the router {settings.router} is not on this machine, and direct processes on "
            "other hosts do not reach this one: say that they may, by "
            f"{OPEN_TO_NETWORK} (everybody who reaches its port can move the robot), or leave "
            "direct out"
        )
    config: dict[str, Any] = {
        "mode": "peer" if settings.direct else "client",
        "connect": {
            "endpoints": [settings.router],
            # Zero is one attempt, not none.
            "timeout_ms": 0,
            "exit_on_failure": True,
            "retry": {"period_init_ms": 50, "period_max_ms": 250, "period_increase_factor": 1.5},
        },
        # Who is there is the router's to say: a broadcast would find other people's cells.
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": settings.direct}},
        "transport": {"unicast": {"open_timeout": OPENING_MS}, "link": {"tx": LINK_OPTIONS}},
    }
    if settings.tls_ca is not None:
        config["transport"]["link"] |= {
            "protocols": ["tls"],
            "tls": {
                "root_ca_certificate": str(settings.tls_ca),
                "connect_certificate": str(settings.tls_certificate),
                "connect_private_key": str(settings.tls_key),
                "enable_mtls": True,
                "verify_name_on_connect": True,
            },
        }
    if settings.direct:
        where = _EVERYWHERE if settings.open_to_network else _LOOPBACK
        config["listen"] = {"endpoints": [where]}
    return zenoh.Config.from_json5(json.dumps(config))


LINK_OPTIONS: dict[str, Any] = {
    "lease": LEASE_MS,
    "queue": {"congestion_control": {"drop": {"wait_before_drop": WAIT_BEFORE_DROP_US}}},
}
"""Of every link, of sessions and routers."""
UNICAST_OPTIONS = {"accept_timeout": ACCEPTING_MS, "accept_pending": ACCEPTING_AT_ONCE}
"""Of every router: connections that say nothing keep nobody out."""


def router_config() -> zenoh.Config:
    """Return the configuration of a router; `deploy/router/router.json5` says the same."""
    config = {
        "mode": "router",
        "listen": {"endpoints": [DEFAULT_ROUTER]},
        # Without it opening waits half a second for other routers to be found.
        "scouting": {"delay": 0, "multicast": {"enabled": False}},
        "transport": {
            "unicast": UNICAST_OPTIONS,
            "link": {"tx": LINK_OPTIONS},
        },
    }
    return zenoh.Config.from_json5(json.dumps(config))
