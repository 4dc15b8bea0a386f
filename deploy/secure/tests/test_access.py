"""What the table gives, the router lets pass, and nothing else: probed role by role, key by key."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from datetime import timedelta

import pytest
import zenoh

from hmcs.bus.bounds import BOUNDS
from hmcs.bus.contract_page import published_keys
from hmcs.bus.keys import Keys
from hmcs.bus.messages import Command, Motion
from hmcs.bus.rights import PEOPLE, is_within, rights_of, roles
from hmcs.bus.verbs import VERBS
from hmcs_secure.authority import create_authority, issue, utc_now
from hmcs_secure.identity import Identity

DEADLINE_S = 30.0
QUIET_S = 0.5
"""What has not passed within so long after something behind it has, never will."""
KEYS = Keys("closed")
PUBLISHED = {
    message.SCHEMA: key.replace("MODEL", "m").replace("INSTANCE", "i")
    for message, key in published_keys(KEYS).items()
}
SERVICES = [role for role in roles() if role not in PEOPLE]
MARK = "hmcs/@v1/closed/presence/console/mark"

Probe = tuple[str, str, str, bool]
"""Right, role, key, and whether it passed."""


class Heard:
    """Payloads by key, as they arrive."""

    def __init__(self) -> None:
        self.got: set[tuple[str, bytes]] = set()
        self._lock = threading.Lock()

    def __call__(self, sample: zenoh.Sample) -> None:
        with self._lock:
            self.got.add((str(sample.key_expr), sample.payload.to_bytes()))


def until(condition: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < deadline_s, "the probe did not come through"
        threading.Event().wait(0.02)


def settle(sessions: Iterable[zenoh.Session]) -> None:
    """Wait until whatever these sessions have sent has been through the router."""
    for session in sessions:
        session.liveliness().get(MARK, timeout=5.0)
    threading.Event().wait(QUIET_S)


def wrong(probes: list[Probe], right: str) -> list[Probe]:
    """Return the probes that went otherwise than the table says."""
    return [
        probe
        for probe in probes
        if probe[3] != is_within(probe[2], getattr(rights_of(probe[1], KEYS), right))
    ]


@pytest.fixture(scope="module")
def sessions(cell) -> dict[str, zenoh.Session]:
    return {role: cell.open(role) for role in roles()}


@pytest.fixture(scope="module")
def counted() -> list[int]:
    return []


def test_a_role_says_what_the_table_gives_it_and_nothing_else(cell, sessions, counted) -> None:
    heard = Heard()
    listener = cell.open("recorder")
    keep = listener.declare_subscriber("hmcs/@v1/closed/**", heard)
    keys = [*PUBLISHED.values(), KEYS.everything.replace("**", "nonsense")]
    rightful = {
        key: next((r for r in roles() if is_within(key, rights_of(r, KEYS).says)), None)
        for key in keys
    }
    for key, role in rightful.items():
        if role is not None:
            until(lambda k=key, r=role: sessions[r].put(k, b"warm") or (k, b"warm") in heard.got)
    for role, session in sessions.items():
        for key in keys:
            session.put(key, role.encode())
    settle(sessions.values())
    probes = [("says", r, k, (k, r.encode()) in heard.got) for r in sessions for k in keys]
    counted.append(len(probes))
    assert wrong(probes, "says") == []
    keep.undeclare()


def test_a_role_hears_what_the_table_gives_it_and_nothing_else(sessions, counted) -> None:
    heard = {role: Heard() for role in sessions}
    keep = [
        session.declare_subscriber(key, heard[role])
        for role, session in sessions.items()
        for key in ("hmcs/@v1/closed/**", *PUBLISHED.values())
    ]
    said = {
        key: next(r for r in roles() if is_within(key, rights_of(r, KEYS).says))
        for key in PUBLISHED.values()
    }
    for key, role in said.items():
        others = [
            other for other in roles()
            if other != role and is_within(key, rights_of(other, KEYS).hears)
        ]  # fmt: skip
        until(
            lambda k=key, r=role, o=others: (
                sessions[r].put(k, b"hi") or all((k, b"hi") in heard[other].got for other in o)
            )
        )
    settle(sessions.values())
    probes = [
        ("hears", role, key, (key, b"hi") in heard[role].got)
        for role in sessions
        for key, sayer in said.items()
        # What a session says itself does not pass the router.
        if role != sayer
    ]
    counted.append(len(probes))
    assert wrong(probes, "hears") == []
    for subscriber in keep:
        subscriber.undeclare()


@pytest.mark.long
def test_a_role_answers_for_itself_alone(sessions, counted) -> None:
    operator, probes = sessions["operator"], list[Probe]()
    keys = {service: KEYS.rpc(service, "i", "health") for service in SERVICES}
    for role, session in sessions.items():
        if role == "operator":
            continue
        keep = [
            session.declare_queryable(key, lambda query: query.reply(query.key_expr, b"me"))
            for key in keys.values()
        ]
        if role in SERVICES:
            until(lambda k=keys[role]: any(r.ok for r in operator.get(k, timeout=2.0)))
        settle([session])
        for key in keys.values():
            answered = any(reply.ok for reply in operator.get(key, timeout=0.5))
            probes.append(("answers", role, key, answered))
        for queryable in keep:
            queryable.undeclare()
    counted.append(len(probes))
    assert wrong(probes, "answers") == []


@pytest.mark.long
def test_a_role_is_present_as_itself_alone(sessions, counted) -> None:
    watcher, probes = sessions["console"], list[Probe]()
    keys = [KEYS.presence(service, "i") for service in SERVICES]
    for role, session in sessions.items():
        tokens = [session.liveliness().declare_token(key) for key in keys]

        def seen() -> set[str]:
            found = watcher.liveliness().get(KEYS.presence(), timeout=2.0)
            return {str(reply.ok.key_expr) for reply in found if reply.ok}

        if role in SERVICES and role != "console":
            until(lambda r=role: KEYS.presence(r, "i") in seen())
        settle([session])
        there = seen()
        probes += [("announces", role, key, key in there) for key in keys if role != "console"]
        for token in tokens:
            token.undeclare()
    counted.append(len(probes))
    assert wrong(probes, "announces") == []


def test_a_role_asks_what_the_table_gives_it_and_nothing_else(sessions, counted) -> None:
    probes, keep = list[Probe](), []
    keys = {
        KEYS.rpc(service, "i", verb.name): service
        for verb in VERBS
        for service in (verb.services or SERVICES)
    }
    for key, service in keys.items():
        queryable = sessions[service].declare_queryable(
            key, lambda query: query.reply(query.key_expr, b"ok")
        )
        keep.append(queryable)
    until(lambda: all(any(r.ok for r in sessions["operator"].get(k, timeout=2.0)) for k in keys))
    for role, session in sessions.items():
        for key, service in keys.items():
            if role != service:
                answered = any(reply.ok for reply in session.get(key, timeout=0.3))
                probes.append(("asks", role, key, answered))
    counted.append(len(probes))
    assert wrong(probes, "asks") == []
    for queryable in keep:
        queryable.undeclare()


def test_the_whole_table_was_probed(counted) -> None:
    assert sum(counted) >= 485, counted


def test_a_certificate_bound_to_an_instance_speaks_for_that_instance_alone(cell) -> None:
    heard = Heard()
    keep = cell.open("recorder").declare_subscriber("hmcs/@v1/closed/**", heard)
    bound = cell.open_with(cell.authority, cell.bound)
    own, others = KEYS.evidence("m", "one"), KEYS.evidence("m", "two")
    until(lambda: bound.put(own, b"mine") or (own, b"mine") in heard.got)
    bound.put(others, b"forged")
    settle([bound])
    assert (others, b"forged") not in heard.got
    keep.undeclare()


def test_a_message_larger_than_its_bound_does_not_pass_the_router(cell, sessions) -> None:
    heard = Heard()
    keep = cell.open("recorder").declare_subscriber("hmcs/@v1/closed/**", heard)
    for message, role in ((Command, "fixture_controller"), (Motion, "input_device")):
        key, fits = PUBLISHED[message.SCHEMA], bytes(BOUNDS[message].size_bytes)
        until(lambda k=key, r=role, f=fits: sessions[r].put(k, f) or (k, f) in heard.got)
        sessions[role].put(key, bytes(2 * len(fits)))
        settle([sessions[role]])
        assert (key, bytes(2 * len(fits))) not in heard.got
    keep.undeclare()


# --- strangers ------------------------------------------------------------------------------------


@pytest.mark.long
def test_who_shows_no_certificate_gets_no_session(cell) -> None:
    with pytest.raises(zenoh.ZError):
        cell.open_with(cell.authority, None)


@pytest.mark.long
@pytest.mark.parametrize("cell_of_stranger", ["closed", "other"])
def test_the_certificate_of_another_authority_gets_no_session(
    cell, tmp_path, cell_of_stranger
) -> None:
    now = utc_now()
    foreign = create_authority(tmp_path / "foreign", cell_of_stranger, now)
    holder = issue(foreign, Identity(cell_of_stranger, "fixture_controller"), now)
    with pytest.raises(zenoh.ZError):
        cell.open_with(cell.authority, holder)


@pytest.mark.long
def test_an_expired_certificate_gets_no_session(cell) -> None:
    long_ago = utc_now() - timedelta(days=30)
    holder = issue(cell.authority, Identity("closed", "robot", "old"), long_ago, days=10)
    with pytest.raises(zenoh.ZError):
        cell.open_with(cell.authority, holder)


def test_a_certificate_the_router_was_never_given_says_and_hears_nothing(cell) -> None:
    heard, stranger_heard = Heard(), Heard()
    keep = cell.open("recorder").declare_subscriber("hmcs/@v1/closed/**", heard)
    unknown = issue(cell.authority, Identity("closed", "fixture_controller", "new"), utc_now())
    stranger = cell.open_with(cell.authority, unknown)
    keep_too = stranger.declare_subscriber("hmcs/@v1/closed/**", stranger_heard)
    key = KEYS.command
    fixture = cell.open("fixture_controller")
    until(lambda: fixture.put(key, b"true") or (key, b"true") in heard.got)
    stranger.put(key, b"forged")
    settle([stranger])
    assert (key, b"forged") not in heard.got
    assert (key, b"true") not in stranger_heard.got
    keep.undeclare()
    keep_too.undeclare()


@pytest.mark.parametrize("mode", ["peer", "router"])
def test_other_kinds_of_session_are_no_way_round_the_rules(cell, mode) -> None:
    heard = Heard()
    keep = cell.open("recorder").declare_subscriber("hmcs/@v1/closed/**", heard)
    observer = cell.holders["observer"]
    stranger = cell.open_with(
        cell.authority, observer, mode=mode, listen={"endpoints": []},
        scouting={"multicast": {"enabled": False}, "gossip": {"enabled": False}},
    )  # fmt: skip
    fixture = cell.open("fixture_controller")
    until(lambda: fixture.put(KEYS.command, b"true") or (KEYS.command, b"true") in heard.got)
    stranger.put(KEYS.command, b"forged")
    settle([fixture])
    assert (KEYS.command, b"forged") not in heard.got
    keep.undeclare()


def test_plain_tcp_gets_no_session(cell) -> None:
    with pytest.raises(zenoh.ZError):
        cell.open_with(
            cell.authority, None,
            connect={"endpoints": [cell.endpoint.replace("tls/", "tcp/")], "timeout_ms": 2000,
                     "exit_on_failure": True},
            transport={},
        )  # fmt: skip
