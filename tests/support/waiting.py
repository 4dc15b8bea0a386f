"""Waiting for what real processes do, with a deadline that only what never comes reaches."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

from hmcs.bus.session import Bus
from hmcs.errors import UserError
from hmcs_local.connecting import open_operator
from support.stack import CELL, DEADLINE_S

A = TypeVar("A")


def wait_until(look: Callable[[], A | None], what: str, deadline_s: float = 3 * DEADLINE_S) -> A:
    """Return the first result that counts as true; fails with `what` after the deadline."""
    until_s = time.monotonic() + deadline_s
    while time.monotonic() < until_s:
        if found := look():
            return found
        time.sleep(0.01)
    raise AssertionError(f"not within {deadline_s:g} s: {what}")


def operator_at(router: str) -> Bus | None:
    """Return an operator's bus, None as long as there is no router."""
    try:
        return open_operator(router, CELL)
    except UserError:
        return None


def wait_present(bus: Bus, *services: str) -> None:
    """Wait until each of these services is there and ready."""

    def there() -> bool:
        bus.pump(0.05)
        return all(bus.present(bus.keys.presence(service)).members for service in services)

    wait_until(there, ", ".join(services))
