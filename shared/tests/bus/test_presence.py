from __future__ import annotations

import signal
import time
from types import SimpleNamespace

import zenoh

PRESENT = """
import sys, time
from hmcs.bus.session import Bus, BusSettings
with Bus.open(BusSettings(router=sys.argv[1], cell="test"), "robot", sys.argv[2]) as bus:
    bus.announce(bus.keys.presence("robot", sys.argv[2]))
    time.sleep(60)
"""


def watch(bus, count: int, seen: list) -> None:
    deadline_s = time.monotonic() + 10
    while len(seen) < count:
        assert time.monotonic() < deadline_s, seen
        bus.pump(0.1)


def test_those_already_there_come_first_and_a_withdrawn_one_goes(join) -> None:
    robot, observer = join("robot", "r"), join("observer")
    token = robot.announce(robot.keys.presence("robot", "r"))
    seen: list[tuple[str, bool]] = []
    observer.watch(observer.keys.presence(), lambda key, alive: seen.append((key, alive)))
    watch(observer, 1, seen)
    token.withdraw()
    token.withdraw()
    watch(observer, 2, seen)
    key = robot.keys.presence("robot", "r")
    assert seen == [(key, True), (key, False)]


def test_a_token_that_is_only_confirmed_is_not_reported_again(join, monkeypatch) -> None:
    observer = join("observer")
    key = observer.keys.presence("robot", "r")
    seen: list[tuple[str, bool]] = []
    heard = []
    liveliness = SimpleNamespace(
        declare_subscriber=lambda _, heard_of, **__: heard.append(heard_of)
    )
    with monkeypatch.context() as patch:
        patch.setattr(observer, "_session", SimpleNamespace(liveliness=lambda: liveliness))
        observer.watch(observer.keys.presence(), lambda key, alive: seen.append((key, alive)))
    kinds = [zenoh.SampleKind.DELETE, zenoh.SampleKind.PUT, zenoh.SampleKind.PUT]
    for kind in (*kinds, *kinds):
        heard[0].callback(SimpleNamespace(key_expr=key, kind=kind))
    while observer.pump(0.0):
        pass
    assert seen == [(key, True), (key, False), (key, True)]


def test_alive_tells_who_is_there_now_each_once(join, until) -> None:
    robot, observer = join("robot", "r"), join("observer", "o")
    for bus in (observer, robot):
        bus.announce(bus.keys.presence(bus.source.service, bus.source.instance))
    both = [observer.keys.presence("observer", "o"), observer.keys.presence("robot", "r")]
    until(lambda: observer.alive(observer.keys.presence()) == both)
    assert observer.alive(observer.keys.presence("nobody")) == []


def test_a_killed_process_vanishes_and_others_stay(join, router, spawn, until) -> None:
    observer = join("observer")
    seen: list[tuple[str, bool]] = []
    observer.watch(observer.keys.presence("robot"), lambda key, alive: seen.append((key, alive)))
    victim, _ = (spawn(PRESENT, router, name) for name in ("victim", "other"))
    watch(observer, 2, seen)
    victim.kill()
    watch(observer, 3, seen)
    assert seen[2] == (observer.keys.presence("robot", "victim"), False)
    other = observer.keys.presence("robot", "other")
    # A question asked while the router still tells of the loss may come back empty.
    until(lambda: observer.alive(observer.keys.presence()) == [other])
    assert len(seen) == 3


def test_a_hung_process_vanishes_when_its_lease_is_over(join, router, spawn) -> None:
    observer = join("observer")
    seen: list[bool] = []
    observer.watch(observer.keys.presence("robot"), lambda _, alive: seen.append(alive))
    process = spawn(PRESENT, router, "r")
    watch(observer, 1, seen)
    process.send_signal(signal.SIGSTOP)
    watch(observer, 2, seen)
    process.send_signal(signal.SIGCONT)
    watch(observer, 3, seen)
    assert seen == [True, False, True]
