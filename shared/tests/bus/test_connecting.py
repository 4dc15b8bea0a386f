"""Far routers, silent ones, none: how long is waited, and how it ends."""

from __future__ import annotations

import contextlib
import logging
import select
import socket
import threading
import time
from collections.abc import Iterator
from types import SimpleNamespace

import pytest
import zenoh

from hmcs.bus import connecting
from hmcs.bus.config import BusSettings
from hmcs.bus.connecting import BusUnavailableError, StoppedError, connect
from hmcs.errors import UserError

LOG = logging.getLogger("hmcs.test")


@contextlib.contextmanager
def far(endpoint: str, one_way_s: float) -> Iterator[str]:
    """An endpoint from which everything takes `one_way_s` to the router and back to the caller."""
    over = threading.Event()
    host, _, port = endpoint.partition("/")[2].rpartition(":")

    def carry(source: socket.socket, target: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while not over.is_set():
                if not select.select([source], [], [], 0.05)[0]:
                    continue
                data = source.recv(65536)
                if not data:
                    break
                time.sleep(one_way_s)
                target.sendall(data)
        with contextlib.suppress(OSError):
            target.shutdown(socket.SHUT_WR)

    def serve() -> None:
        carriers: list[threading.Thread] = []
        ends: list[socket.socket] = []
        while not over.is_set():
            if not select.select([server], [], [], 0.05)[0]:
                continue
            near, _ = server.accept()
            time.sleep(one_way_s)
            there = socket.create_connection((host, int(port)))
            ends += [near, there]
            for pair in ((near, there), (there, near)):
                carriers.append(threading.Thread(target=carry, args=pair))
                carriers[-1].start()
        for carrier in carriers:
            carrier.join()
        for end in ends:
            end.close()

    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield f"tcp/127.0.0.1:{server.getsockname()[1]}"
        finally:
            over.set()
            thread.join()


@pytest.fixture
def silent() -> Iterator[str]:
    """An endpoint that accepts connections and never says a word."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield f"tcp/127.0.0.1:{server.getsockname()[1]}"


@pytest.mark.parametrize("router", ["tcp/192.0.2.1:7447", "tcp/router:7447"])
def test_a_direct_process_that_others_would_not_hear_is_warned(router) -> None:
    settings = BusSettings(router=router, direct=True)
    with pytest.raises(UserError, match=r"do not reach this one.*--open-to-network"):
        connect(settings, LOG, lambda: False)


def test_a_direct_process_that_may_be_reached_looks_for_a_router_elsewhere() -> None:
    settings = BusSettings(
        router="tcp/192.0.2.1:7447", direct=True, open_to_network=True, connect_timeout_s=0.1
    )
    with pytest.raises(BusUnavailableError):
        connect(settings, LOG, lambda: False)


def attempts() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "connecting"]


@pytest.mark.parametrize("direct", [False, True])
def test_a_router_a_second_away_is_reached(router, direct) -> None:
    with far(router, 0.25) as endpoint:
        settings = BusSettings(router=endpoint, direct=direct, connect_timeout_s=60)
        with connect(settings, LOG, lambda: False) as session:
            assert list(session.info.routers_zid())


def test_stopping_does_not_wait_for_an_attempt_that_nobody_answers(silent) -> None:
    polled = []

    def stopping() -> bool:
        polled.append(1)
        return len(polled) > 3

    with pytest.raises(StoppedError):
        connect(BusSettings(router=silent), LOG, stopping)
    assert attempts(), "it is still under way, and was not waited for"


def test_the_time_set_counts_where_an_attempt_would_take_longer(silent) -> None:
    settings = BusSettings(router=silent, connect_timeout_s=0.2)
    with pytest.raises(BusUnavailableError, match=r"within 0\.2 s: .*it does not answer"):
        connect(settings, LOG, lambda: False)
    assert attempts(), "it is still under way, and was not waited for"


def test_an_attempt_that_was_given_up_closes_the_session_it_opens(
    router, monkeypatch, until
) -> None:
    opened, go_on = [], threading.Event()
    zenoh_open = zenoh.open

    def late(config: zenoh.Config) -> zenoh.Session:
        go_on.wait()
        opened.append(zenoh_open(config))
        return opened[0]

    monkeypatch.setattr(connecting.zenoh, "open", late)
    with pytest.raises(BusUnavailableError):
        connect(BusSettings(router=router, connect_timeout_s=0.1), LOG, lambda: False)
    go_on.set()
    until(lambda: opened and opened[0].is_closed())


def test_beside_an_attempt_that_does_not_end_another_one_is_made(
    router, monkeypatch, until
) -> None:
    opened, go_on, calls = [], threading.Event(), []
    zenoh_open = zenoh.open

    def first_one_late(config: zenoh.Config) -> zenoh.Session:
        calls.append(config)
        if len(calls) > 1:
            return zenoh_open(config)
        go_on.wait()
        opened.append(zenoh_open(config))
        return opened[0]

    monkeypatch.setattr(connecting.zenoh, "open", first_one_late)
    monkeypatch.setattr(connecting, "_ATTEMPT_S", 0.2)
    kept: set[object] = set()
    to_exit = SimpleNamespace(register=kept.add, unregister=kept.discard)
    monkeypatch.setattr(connecting, "atexit", to_exit)
    settings = BusSettings(router=router, connect_timeout_s=60)
    with connect(settings, LOG, lambda: False) as session:
        assert list(session.info.routers_zid())
        assert kept
        go_on.set()
        until(lambda: opened and opened[0].is_closed() and not kept)
        assert not session.is_closed()


def test_an_interrupt_while_waiting_gives_the_attempt_up(router, monkeypatch, until) -> None:
    opened, go_on = [], threading.Event()
    zenoh_open = zenoh.open

    def late(config: zenoh.Config) -> zenoh.Session:
        go_on.wait()
        opened.append(zenoh_open(config))
        return opened[0]

    def interrupted() -> bool:
        raise KeyboardInterrupt

    monkeypatch.setattr(connecting.zenoh, "open", late)
    with pytest.raises(KeyboardInterrupt):
        connect(BusSettings(router=router), LOG, interrupted)
    go_on.set()
    until(lambda: opened and opened[0].is_closed())


def test_what_goes_wrong_in_an_attempt_is_reported(monkeypatch, router) -> None:
    def fail(_: zenoh.Config) -> zenoh.Session:
        raise MemoryError("no room")

    monkeypatch.setattr(connecting.zenoh, "open", fail)
    with pytest.raises(MemoryError, match="no room"):
        connect(BusSettings(router=router), LOG, lambda: False)


def test_waiting_keeps_no_thread_of_an_attempt_that_has_ended(free_endpoint, until) -> None:
    seen = []

    def stopping() -> bool:
        seen.append(len(attempts()))
        return len(seen) > 40

    with pytest.raises(StoppedError):
        connect(BusSettings(router=free_endpoint), LOG, stopping)
    assert max(seen) <= 2
    until(lambda: not attempts())


GIVES_UP_AND_ENDS = """
import logging, socket, sys, time
from hmcs.bus import connecting, config

config.OPENING_MS = connecting.OPENING_MS = 1000

class EndsSlowly:
    def __del__(self):
        time.sleep(2)

ends_slowly = EndsSlowly()
server = socket.create_server(("127.0.0.1", 0))
settings = config.BusSettings(
    router=f"tcp/127.0.0.1:{server.getsockname()[1]}", connect_timeout_s=0.1
)
try:
    connecting.connect(settings, logging.getLogger("x"), lambda: False)
except connecting.BusUnavailableError:
    sys.exit(7)
"""


@pytest.mark.long
def test_a_process_that_ends_right_after_giving_up_ends_cleanly(spawn) -> None:
    process = spawn(GIVES_UP_AND_ENDS)
    assert process.wait(60) == 7, process.log.read_text()
