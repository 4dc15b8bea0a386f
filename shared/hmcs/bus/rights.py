"""Who says, hears, asks, answers and announces what: one table for every role in a cell.

Three things come from it: what a service may declare (`Bus` refuses anything else to a service of
the table), the access control of a closed cell's router (`hmcs secure`), and the tables of the
contract page. A role is a kind of service, or one of the people's own: `operator`, who may act, and
`observer`, who looks.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import zenoh

from hmcs.bus.keys import ANY, Keys
from hmcs.bus.verbs import (
    ACTIVATE,
    CANCEL,
    CHANGE_RECORDING,
    DESCRIBE,
    HEALTH,
    LAST_STEPS,
    LOAD_MODEL,
    LOOKS,
    MODEL_FILE,
    OUTLINE,
    PLAY,
    RECORD,
    SEGMENT,
    SET_LABELS,
    SETTINGS,
    STOP,
    TRAIN,
    VERBS,
    verbs_of,
)

OPERATOR = "operator"
OBSERVER = "observer"
PEOPLE = (OPERATOR, OBSERVER)
"""Roles that are no service: they come and go, answer nothing and announce nothing."""


class Rights(NamedTuple):
    """What one role may do, as key expressions."""

    says: tuple[str, ...]
    """Keys it publishes on."""
    hears: tuple[str, ...]
    """Keys it subscribes to."""
    answers: tuple[str, ...]
    """Questions it answers."""
    asks: tuple[str, ...]
    """Questions it asks."""
    announces: tuple[str, ...]
    """Liveliness tokens it shows."""
    watches: tuple[str, ...]
    """Liveliness tokens it looks for."""


class RightsError(Exception):
    """A service declares what the table does not give it: a mistake in the service or the table."""


def roles() -> tuple[str, ...]:
    """Return every role of the table."""
    return tuple(_table(Keys("cell"), ANY))


def rights_of(role: str, keys: Keys, instance: str = ANY) -> Rights:
    """Return the rights of a role in a cell, those on keys of one `instance` where it is given.

    Raises KeyError for a role that the table does not have.
    """
    return _table(keys, instance)[role]


def check_right(rights: Rights | None, what: str, key: str) -> None:
    """Raise RightsError unless `key` is within one of the keys of the right `what`.

    `rights` is None for a process that no table names: nothing is refused to it here.
    """
    if rights is None:
        return
    given: Sequence[str] = getattr(rights, what)
    if not is_within(key, given):
        raise RightsError(
            f"{key}: the table of rights (hmcs/bus/rights.py) does not list it under {what!r}, "
            f"which has {', '.join(given) or 'nothing'}"
        )


def is_within(key: str, expressions: Iterable[str]) -> bool:
    """Return whether one of the key expressions includes all of `key`."""
    wanted = zenoh.KeyExpr(key)
    return any(zenoh.KeyExpr(expression).includes(wanted) for expression in expressions)


def _table(keys: Keys, instance: str) -> dict[str, Rights]:
    any_presence = keys.presence()
    evidence, belief = keys.evidence(ANY, instance), keys.belief(ANY, instance)
    evidences, beliefs = keys.evidence(ANY), keys.belief()

    def rpc(*asked: tuple[str, object]) -> tuple[str, ...]:
        return tuple(keys.rpc(service, ANY, verb.name) for service, verb in asked)  # type: ignore[attr-defined]

    def service(
        name: str,
        *,
        says: tuple[str, ...] = (),
        hears: tuple[str, ...] = (),
        asks: tuple[str, ...] = (),
        announces: tuple[str, ...] = (),
        watches: tuple[str, ...] = (),
    ) -> Rights:
        # Its health check comes with the certificate of the service it asks.
        return Rights(
            says,
            hears,
            tuple(keys.rpc(name, instance, verb.name) for verb in verbs_of(name)),
            (keys.rpc(name, ANY, HEALTH.name), *asks),
            (keys.presence(name, instance), *announces),
            (keys.presence(name), *watches),
        )

    last_steps = rpc(("input_device", LAST_STEPS))
    shown = (
        keys.motion,
        keys.step,
        evidences,
        beliefs,
        keys.fixture_state,
        keys.robot_state,
        keys.training,
    )
    everything_seen = (
        *shown,
        keys.handle,
        keys.label,
        keys.command,
        keys.pairing,
        keys.stop_request,
    )
    people_ask = rpc(*((service, verb) for verb in VERBS for service in verb.services or (ANY,)))
    return {
        "input_device": service(
            "input_device",
            says=(keys.motion, keys.step),
            hears=(keys.robot_state, keys.fixture_state, keys.handle, keys.pairing),
            watches=(any_presence,),
        ),
        "gesteme_classifier": service(
            "gesteme_classifier",
            says=(evidence,),
            hears=(keys.step, keys.pairing),
            asks=last_steps,
            announces=(keys.member(ANY, "gesteme_classifier", instance),),
            watches=(keys.member(ANY, "gesteme_classifier"),),
        ),
        "task_hmm": service(
            "task_hmm",
            says=(belief,),
            hears=(keys.step, keys.pairing, evidences),
            asks=last_steps,
            announces=(keys.member(ANY, "task_hmm", instance),),
        ),
        "recognizer": service(
            "recognizer",
            says=(evidence, belief),
            hears=(keys.step, keys.pairing),
            asks=last_steps,
            announces=(keys.member(ANY, "recognizer", instance),),
        ),
        "fixture_controller": service(
            "fixture_controller",
            says=(keys.command, keys.fixture_state, keys.pairing),
            hears=(keys.motion, keys.step, beliefs, keys.robot_state),
            asks=last_steps,
            watches=(any_presence, keys.member(ANY)),
        ),
        "robot": service(
            "robot",
            says=(keys.robot_state,),
            hears=(keys.command, keys.pairing, keys.stop_request),
        ),
        "recorder": service(
            "recorder",
            hears=(keys.everything,),
            asks=(
                *rpc((ANY, DESCRIBE), (ANY, SETTINGS), ("robot", LOOKS)),
                *last_steps,
            ),
        ),
        "trainer": service(
            "trainer",
            says=(keys.training,),
            hears=(keys.training,),
            asks=rpc(("fixture_controller", MODEL_FILE)),
            watches=(keys.presence("trainer"),),
        ),
        "console": service(
            "console",
            says=(keys.handle, keys.label, keys.stop_request),
            hears=shown,
            asks=rpc(
                (ANY, HEALTH),
                (ANY, DESCRIBE),
                ("input_device", PLAY),
                ("robot", LOOKS),
                ("robot", STOP),
                ("fixture_controller", ACTIVATE),
                ("fixture_controller", LOAD_MODEL),
                ("fixture_controller", MODEL_FILE),
                ("recognizer", LOAD_MODEL),
                ("recorder", RECORD),
                ("recorder", OUTLINE),
                ("recorder", SET_LABELS),
                ("recorder", CHANGE_RECORDING),
                ("trainer", TRAIN),
                ("trainer", CANCEL),
                ("trainer", SEGMENT),
            ),
            watches=(any_presence, keys.member(ANY)),
        ),
        "ros2_bridge": service(
            "ros2_bridge",
            hears=(keys.motion, keys.robot_state, keys.fixture_state, beliefs),
            watches=(any_presence,),
        ),
        OPERATOR: Rights(
            says=(keys.label, keys.stop_request),
            hears=everything_seen,
            answers=(),
            asks=people_ask,
            announces=(),
            watches=(any_presence, keys.member(ANY)),
        ),
        OBSERVER: Rights(
            says=(),
            hears=everything_seen,
            answers=(),
            asks=rpc((ANY, HEALTH), (ANY, DESCRIBE)),
            announces=(),
            watches=(any_presence, keys.member(ANY)),
        ),
    }
