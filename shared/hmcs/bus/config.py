"""How sessions are set up: every Zenoh option that is not its default stands here."""

from __future__ import annotations

import json
import re
from typing import Any

import zenoh
from pydantic import BaseModel, ConfigDict, Field, field_validator

from hmcs.bus.keys import check_name

DEFAULT_ROUTER = "tcp/127.0.0.1:7447"
LEASE_MS = 1000
"""How long a silent session counts as alive; it is announced by the side that may fall silent."""
WAIT_BEFORE_DROP_US = 50_000
"""How long a full queue holds a message back before it is dropped: bursts pass without a loss."""

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
    connect_timeout_s: float | None = Field(default=None, gt=0)
    """How long to wait for a router; None waits for ever."""

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


def client_config(settings: BusSettings, attempt_ms: int) -> zenoh.Config:
    """Return the configuration of a session that tries for `attempt_ms` to reach the router.

    Once open it reconnects by itself for ever, 50 to 250 ms apart.
    """
    config: dict[str, Any] = {
        "mode": "peer" if settings.direct else "client",
        "connect": {
            "endpoints": [settings.router],
            "timeout_ms": attempt_ms,
            "exit_on_failure": True,
            "retry": {"period_init_ms": 50, "period_max_ms": 250, "period_increase_factor": 1.5},
        },
        # Who is there is the router's to say: a broadcast would find other people's cells.
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": settings.direct}},
        "transport": {"link": {"tx": _LINK}},
    }
    if settings.direct:
        config["listen"] = {"endpoints": ["tcp/[::]:0"]}
    return zenoh.Config.from_json5(json.dumps(config))


_LINK = {
    "lease": LEASE_MS,
    "queue": {"congestion_control": {"drop": {"wait_before_drop": WAIT_BEFORE_DROP_US}}},
}


def router_config() -> zenoh.Config:
    """Return the configuration of a router; `deploy/router/router.json5` says the same."""
    config = {
        "mode": "router",
        # Without it opening waits half a second for other routers to be found.
        "scouting": {"delay": 0, "multicast": {"enabled": False}},
        "transport": {"link": {"tx": _LINK}},
    }
    return zenoh.Config.from_json5(json.dumps(config))
