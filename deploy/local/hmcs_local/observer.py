"""A place on the bus for commands that ask and watch, and take part in nothing."""

from __future__ import annotations

import logging
import os
from typing import NamedTuple

from pydantic import ValidationError

from hmcs.bus.keys import ANY, KeyNameError, Member
from hmcs.bus.messages import Ask, Description, Health
from hmcs.bus.session import Bus, BusSettings
from hmcs.errors import UserError

_CONNECT_TIMEOUT_S = 3.0
_ANSWER_TIMEOUT_S = 0.5


class Sighting(NamedTuple):
    """One process as it shows itself at one moment."""

    member: Member
    boot: str
    """Empty where it did not answer."""
    health: Health | None
    """None where it is present and does not answer."""
    facts: dict[str, str]


def open_observer(router: str, cell: str) -> Bus:
    """Join the bus to look at it; raises UserError where there is no router or names are wrong."""
    try:
        settings = BusSettings(router=router, cell=cell, connect_timeout_s=_CONNECT_TIMEOUT_S)
    except (ValidationError, KeyNameError) as error:
        reason = error.errors()[0]["msg"] if isinstance(error, ValidationError) else str(error)
        raise UserError(reason) from None
    quiet = logging.Logger("observer")
    quiet.addHandler(logging.NullHandler())
    return Bus.open(settings, "observer", f"pid-{os.getpid()}", log=quiet)


def look(bus: Bus) -> list[Sighting]:
    """Return who is there and how each is, sorted by service and instance."""
    keys = bus.keys
    present = {keys.member_of(key) for key in bus.alive(keys.presence())}
    healths = {
        Member(answer.envelope.source.service, answer.envelope.source.instance): answer
        for answer in bus.ask(keys.rpc(ANY, ANY, "health"), Ask(), Health, _ANSWER_TIMEOUT_S)
    }
    descriptions = bus.ask(keys.rpc(ANY, ANY, "describe"), Ask(), Description, _ANSWER_TIMEOUT_S)
    facts = {
        Member(answer.envelope.source.service, answer.envelope.source.instance): answer.body.facts
        for answer in descriptions
    }
    return [
        Sighting(
            member,
            healths[member].envelope.source.boot if member in healths else "",
            healths[member].body if member in healths else None,
            facts.get(member, {}),
        )
        for member in sorted(present | set(healths))
    ]
