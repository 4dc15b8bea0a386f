"""From what pages do with their handles to the one handle that the input device hears.

One page operates at a time. Holding the handle is the dead-man's switch: a page that lets go, goes
away, is stopped, or gives no sign of life for as long as the lease lasts has released it, and has
to grab the handle anew.

A page may keep its handle to a plane, and scale it. A change of that while the handle is held holds
from the next time it is taken: its arrows cannot change while one of them is dragged, so what is
drawn and what is sent would not be the same. Positions are measured from where it was taken, so
that none depends on what came between.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hmcs.bus.messages import Handle
from hmcs_console.operating import lease as leases
from hmcs_console.operating.lease import Lease
from hmcs_console.operating.rules import FREE, Grip, Rule, led_to

SETTLE_S = 0.03
"""So long a grabbed handle is sent as released: where two of them wait, only the newer is heard."""
PEDAL_S = 0.3
"""The page says again and again that its pedal is down; after so long without it, it is up."""


class Grabbed(NamedTuple):
    """A page took hold of its handle."""

    client: int
    at_s: float
    position: NDArray[np.float64]
    """m, base frame, shape (3,)."""


class Moved(NamedTuple):
    """A page moved its handle."""

    client: int
    at_s: float
    position: NDArray[np.float64]
    """m, base frame, shape (3,)."""


class LetGo(NamedTuple):
    """A page let go of its handle."""

    client: int


class Gone(NamedTuple):
    """A page is gone."""

    client: int


class Alive(NamedTuple):
    """A page answered."""

    client: int
    at_s: float


class Clutched(NamedTuple):
    """A page pressed its clutch, or let go of it."""

    client: int
    on: bool


class Pedaled(NamedTuple):
    """A page's pedal is down."""

    client: int
    at_s: float


class Ruled(NamedTuple):
    """A page has its handle lead otherwise."""

    client: int
    rule: Rule


class TookOver(NamedTuple):
    """A page wants to operate instead of the one that does."""

    client: int


class Stopped(NamedTuple):
    """Somebody wants the robot to stand."""


Event = Grabbed | Moved | LetGo | Gone | Alive | Clutched | Pedaled | Ruled | TookOver | Stopped


class Operating(NamedTuple):
    """How the pages operate now."""

    console: str
    """Name of this console: operators are distinguished by it and the number of their page."""
    lease: Lease = leases.FREE
    position: NDArray[np.float64] = np.zeros(3)
    """Where the operator's handle leads to, m, base frame, shape (3,)."""
    grip: Grip = Grip(np.zeros(3))
    """How the operator took hold of it."""
    rules: Mapping[int, Rule] = MappingProxyType({})
    """By the pages that do not have their handle lead freely."""
    clutched: frozenset[int] = frozenset()
    """Pages whose clutch is pressed."""
    held_from_s: float = 0.0
    """The handle counts as held from then on."""
    pedal_until_s: float = 0.0

    @property
    def operator(self) -> str:
        """Who operates; empty while nobody does."""
        return "" if self.lease.client is None else operator_of(self.console, self.lease.client)

    def handle(self, now_s: float) -> Handle | None:
        """Return the handle message to send while the handle is held; None while it is not."""
        if self.lease.client is None or now_s < self.held_from_s:
            return None
        return Handle(
            operator=self.operator,
            position=self.position,
            dead_man=True,
            clutch=self.lease.client in self.clutched,
            pedal=now_s < self.pedal_until_s,
        )


class Outcome(NamedTuple):
    """What follows from an event."""

    operating: Operating
    handles: tuple[Handle, ...] = ()
    """To be published at once."""
    notices: tuple[tuple[int, str], ...] = ()
    """Messages to the pages."""


def operator_of(console: str, client: int) -> str:
    """Return what a page is called as an operator."""
    return f"{console[:50]}-page-{client}"


def after(operating: Operating, event: Event) -> Outcome:
    """Return what follows from something a page did."""
    match event:
        case Grabbed():
            return _after_grab(operating, event)
        case Moved(client, at_s, position) if leases.holds(operating.lease, client):
            lease = leases.alive(operating.lease, client, at_s)
            position_sent = led_to(operating.grip, position)
            return Outcome(operating._replace(lease=lease, position=position_sent))
        case Alive(client, at_s):
            return Outcome(operating._replace(lease=leases.alive(operating.lease, client, at_s)))
        case LetGo(client):
            return _released(operating, leases.given_up(operating.lease, client))
        case Gone(client):
            without = operating._replace(
                clutched=operating.clutched - {client}, rules=_ruled(operating, client, FREE)
            )
            return _released(without, leases.given_up(operating.lease, client))
        case Clutched(client, on):
            others = operating.clutched - {client}
            return Outcome(operating._replace(clutched=others | {client} if on else others))
        case Ruled(client, rule):
            return Outcome(operating._replace(rules=_ruled(operating, client, rule)))
        case Pedaled(client, at_s) if leases.holds(operating.lease, client):
            return Outcome(operating._replace(pedal_until_s=at_s + PEDAL_S))
        case TookOver(client) if operating.lease.client not in (None, client):
            return _released(
                operating, leases.FREE, "another page took over: grab the handle anew to go on"
            )
        case Stopped():
            return _released(operating, leases.FREE, "stopped: grab the handle anew to go on")
        case _:
            return Outcome(operating)


def waited(operating: Operating, now_s: float, lease_s: float) -> Outcome:
    """Return what follows from the time that went by."""
    return _released(
        operating,
        leases.at(operating.lease, now_s, lease_s),
        "this page was silent for too long: grab the handle anew to go on",
    )


def _after_grab(operating: Operating, event: Grabbed) -> Outcome:
    lease = leases.grabbed(operating.lease, event.client, event.at_s)
    if not leases.holds(lease, event.client):
        notice = "another page operates: this handle moves nothing until it lets go"
        return Outcome(operating, notices=((event.client, notice),))
    held = operating._replace(
        lease=lease,
        position=event.position,
        grip=Grip(event.position, operating.rules.get(event.client, FREE)),
        held_from_s=event.at_s + SETTLE_S,
        pedal_until_s=0.0,
    )
    # Said as released first: the way from where a handle was let go before is no motion.
    return Outcome(held, handles=(_release(held),))


def _ruled(operating: Operating, client: int, rule: Rule) -> dict[int, Rule]:
    others = {page: kept for page, kept in operating.rules.items() if page != client}
    return others if rule == FREE else others | {client: rule}


def _released(operating: Operating, lease: Lease, notice: str = "") -> Outcome:
    client = operating.lease.client
    if client is None or lease.client is not None:
        return Outcome(operating._replace(lease=lease))
    return Outcome(
        operating._replace(lease=lease),
        handles=(_release(operating),),
        notices=((client, notice),) if notice else (),
    )


def _release(operating: Operating) -> Handle:
    return Handle(operator=operating.operator, position=operating.position, dead_man=False)
