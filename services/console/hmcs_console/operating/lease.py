"""Who operates: one page at a time, for as long as it shows that it lives. Functions of time."""

from __future__ import annotations

from typing import NamedTuple


class Lease(NamedTuple):
    """The right of one page to move the robot."""

    client: int | None = None
    """The page that holds it; None while nobody does."""
    alive_s: float = 0.0
    """Its last sign of life, by the local monotonic clock."""


FREE = Lease()


def holds(lease: Lease, client: int) -> bool:
    """Whether a page holds the lease."""
    return lease.client == client


def grabbed(lease: Lease, client: int, now_s: float) -> Lease:
    """Return the lease after a page grabbed the handle: its own only where nobody holds it."""
    return Lease(client, now_s) if lease.client in (None, client) else lease


def alive(lease: Lease, client: int, now_s: float) -> Lease:
    """Return the lease after a sign of life; another's page changes nothing."""
    return Lease(client, max(now_s, lease.alive_s)) if holds(lease, client) else lease


def given_up(lease: Lease, client: int) -> Lease:
    """Return the lease after a page let go or went away."""
    return FREE if holds(lease, client) else lease


def at(lease: Lease, now_s: float, lease_s: float) -> Lease:
    """Return what is left of the lease now: nothing, `lease_s` after the last sign of life."""
    return FREE if lease.client is not None and now_s - lease.alive_s > lease_s else lease
