"""A place on the bus for commands that ask and watch, and take part in nothing."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable
from typing import NamedTuple

from pydantic import ValidationError

from hmcs.bus.keys import ANY, KeyNameError, Keys, Member
from hmcs.bus.messages import Ask, Envelope, Health
from hmcs.bus.presence import member_named, model_named, possible, present
from hmcs.bus.session import Bus, BusSettings
from hmcs.bus.verbs import DESCRIBE, HEALTH
from hmcs.errors import UserError

_CONNECT_TIMEOUT_S = 3.0
_ANSWER_TIMEOUT_S = 0.5


CLASSIFIER = "gesteme_classifier"
"""Works for a model and believes in nothing: without a task HMM nobody speaks for the model."""


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


class Observation(NamedTuple):
    """Everybody at one moment."""

    sightings: tuple[Sighting, ...]
    """Sorted by service and instance; two processes under one name are two."""
    speakers: dict[str, tuple[Member, ...]]
    """By model, who is ready to publish beliefs of it."""
    strangers: tuple[str, ...]
    """Tokens of impossible names."""


def look(bus: Bus) -> list[Sighting]:
    """Return who is there and how each is, sorted by service and instance."""
    return list(observe(bus).sightings)


def observe(bus: Bus) -> Observation:
    """Return who is there, how each is, and which models they speak for."""
    keys = bus.keys
    there = present(keys, bus.alive(keys.presence()))
    at_work = bus.alive(keys.member(ANY))
    healths = {
        sender: answer.body
        for answer in HEALTH.ask(bus, Ask(), timeout_s=_ANSWER_TIMEOUT_S)
        if (sender := _sender(answer.envelope)) is not None
    }
    facts = {
        sender: answer.body.facts
        for answer in DESCRIBE.ask(bus, Ask(), timeout_s=_ANSWER_TIMEOUT_S)
        if (sender := _sender(answer.envelope)) is not None
    }
    silent = set(there.members) - {member for member, _ in healths}
    everybody = sorted([*healths, *((member, "") for member in silent)])
    return Observation(
        sightings=tuple(
            Sighting(member, boot, healths.get((member, boot)), facts.get((member, boot), {}))
            for member, boot in everybody
        ),
        speakers=_speakers(keys, at_work),
        strangers=(*there.strangers, *present(keys, at_work).strangers),
    )


def speakers(bus: Bus) -> dict[str, tuple[Member, ...]]:
    """Return, by model, the processes that are ready to publish beliefs of it."""
    return _speakers(bus.keys, bus.alive(bus.keys.member(ANY)))


def _speakers(keys: Keys, tokens: Iterable[str]) -> dict[str, tuple[Member, ...]]:
    found: dict[str, list[Member]] = {}
    for token in tokens:
        member = member_named(keys, token)
        if member is not None and member.service != CLASSIFIER:
            found.setdefault(model_named(keys, token), []).append(member)
    return {model: tuple(sorted(members)) for model, members in sorted(found.items())}


def _sender(envelope: Envelope) -> tuple[Member, str] | None:
    """Return who sent an answer and in which life; None for a name nobody can bear."""
    source = envelope.source
    member = Member(source.service, source.instance)
    return (member, source.boot) if possible(member) else None
