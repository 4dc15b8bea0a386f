"""Who is there and how each is, at one moment."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from hmcs.bus.keys import ANY, Keys, Member
from hmcs.bus.messages import Ask, Envelope, Health
from hmcs.bus.session import Bus
from hmcs.bus.verbs import DESCRIBE, HEALTH
from hmcs.recognizer_takeover import publishes_beliefs

_ANSWER_TIMEOUT_S = 0.5


class Sighting(NamedTuple):
    """One process as it shows itself at one moment."""

    member: Member
    boot: str
    """Empty where it did not answer."""
    health: Health | None
    """None where it is present and does not answer."""
    facts: dict[str, str]


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
    there, at_work = bus.present(keys.presence()), bus.present(keys.member(ANY))
    healths = {
        _sender(answer.envelope): answer.body
        for answer in HEALTH.ask(bus, Ask(), timeout_s=_ANSWER_TIMEOUT_S)
    }
    facts = {
        _sender(answer.envelope): answer.body.facts
        for answer in DESCRIBE.ask(bus, Ask(), timeout_s=_ANSWER_TIMEOUT_S)
    }
    silent = set(there.members) - {member for member, _ in healths}
    everybody = sorted([*healths, *((member, "") for member in silent)])
    return Observation(
        sightings=tuple(
            Sighting(member, boot, healths.get((member, boot)), facts.get((member, boot), {}))
            for member, boot in everybody
        ),
        speakers=_speakers(keys, at_work.tokens),
        strangers=(*there.strangers, *at_work.strangers),
    )


def speakers(bus: Bus) -> dict[str, tuple[Member, ...]]:
    """Return, by model, the processes that are ready to publish beliefs of it."""
    return _speakers(bus.keys, bus.alive(bus.keys.member(ANY)))


def _speakers(keys: Keys, tokens: Iterable[str]) -> dict[str, tuple[Member, ...]]:
    found: dict[str, list[Member]] = {}
    for token in tokens:
        if publishes_beliefs(member := keys.member_of(token)):
            found.setdefault(keys.model_of(token), []).append(member)
    return {model: tuple(sorted(members)) for model, members in sorted(found.items())}


def _sender(envelope: Envelope) -> tuple[Member, str]:
    """Return who sent an answer and in which life."""
    source = envelope.source
    return Member(source.service, source.instance), source.boot
