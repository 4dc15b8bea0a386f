"""`python -m hmcs.bus.health` against processes that are well, ill, hung, and none."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import pytest
import zenoh

from hmcs.bus import health
from hmcs.bus.config import BusSettings
from hmcs.bus.messages import Ask, Envelope, Health, Source
from hmcs.bus.session import Bus, RequestRefusedError
from hmcs.bus.wire import encode

EMPTY = {"received": {}, "sent": {}, "lost": {}, "refused": {}, "late": {}}


def said(healthy: bool = True, detail: str = "running") -> Health:
    return Health(
        healthy=healthy, detail=detail, uptime_s=1.0, loop_rate_hz=1.0, cpu_s=0.1, **EMPTY
    )


def refuse() -> Health:
    raise RequestRefusedError("not now")


@contextmanager
def process(router: str, instance: str, answer: Callable[[], Health]) -> Iterator[None]:
    """A process `thing/instance` that is present and answers so."""
    over = threading.Event()

    def live(bus: Bus) -> None:
        while not over.is_set():
            bus.pump(0.01)

    with Bus.open(BusSettings(router=router), "thing", instance) as bus:
        bus.answer("health", Ask, lambda _: answer())
        bus.announce(bus.keys.presence("thing", instance))
        thread = threading.Thread(target=live, args=(bus,))
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()


def shown(bus: Bus) -> int:
    found = bus.present(bus.keys.presence("thing"))
    return len(found.tokens) + len(found.strangers)


@pytest.fixture
def asked(router, capsys, until) -> Iterator[Callable[..., tuple[int, str]]]:
    """Ask how `thing` is while processes and tokens are there; return exit code and output."""
    with ExitStack() as opened:
        observer = opened.enter_context(Bus.open(BusSettings(router=router), "tester", "a"))

        def ask(
            processes: dict[str, Callable[[], Health]], tokens: tuple[str, ...] = (), *words: str
        ) -> tuple[int, str]:
            for instance, answer in processes.items():
                opened.enter_context(process(router, instance, answer))
            prefix = observer.keys.presence("thing", "x").removesuffix("/x")
            for token in tokens:
                observer.announce(f"{prefix}/{token}")
            count = len(processes) + len(tokens)
            until(lambda: shown(observer) == count)
            code = health.main(["--service", "thing", "--router", router, *words])
            return code, capsys.readouterr().out

        yield ask


def test_all_must_be_well_and_say_so(asked) -> None:
    assert asked({"a": said, "b": said}) == (0, "")


def test_each_that_is_ill_is_reported(asked) -> None:
    code, out = asked({"a": said, "b": lambda: said(False, "no motion"), "c": lambda: said(False)})
    assert (code, out) == (1, "thing: b: no motion; c: running\n")


def test_one_that_is_present_and_does_not_answer_is_not_healthy(asked, router) -> None:
    code, out = asked({"a": said}, ("hung",))
    assert code == 1
    assert "hung: is present, but did not answer within 1 s" in out
    assert health.main(["--service", "thing", "--router", router, "--instance", "hung"]) == 1
    assert health.main(["--service", "thing", "--router", router, "--instance", "a"]) == 0


def test_one_that_refuses_to_say_is_not_healthy(asked) -> None:
    code, out = asked({"a": said, "b": refuse})
    assert code == 1
    assert "b: is present, but did not answer" in out


@pytest.mark.parametrize("name", ["evil name", "\x1b[2Jx", "n" * 300, "-x"])
def test_a_token_no_process_can_have_makes_nobody_ill(asked, name) -> None:
    assert asked({"a": said}, (name,)) == (0, "")


def test_what_a_stranger_says_of_itself_is_shown_without_control_characters(asked) -> None:
    _, out = asked({"a": lambda: said(False, "\x1b[2J\u202egone")})
    assert out == "thing: a: \\x1b[2J\\u202egone\n"


def test_where_nobody_is_there_that_is_reported(asked) -> None:
    code, out = asked({})
    assert code == 1
    assert "nobody answered on" in out


@pytest.mark.parametrize(
    ("service", "instance"), [("other", "hung"), ("thing", "\x1b[2J"), ("thing", "b")]
)
def test_one_that_answers_in_its_place_does_not_make_a_silent_one_healthy(
    asked, router, service, instance
) -> None:
    stranger = Source.model_construct(service=service, instance=instance, boot="b")
    with Bus.open(BusSettings(router=router), "stranger", "s") as bus:
        key = bus.keys.rpc("thing", "hung", "health")

        def pretend(query: zenoh.Query) -> None:
            with query:
                query.reply(key, encode(said(), Envelope(source=stranger, seq=0)))

        bus._declared.append(bus._session.declare_queryable(key, pretend))
        code, out = asked({}, ("hung",))
    assert code == 1
    assert "hung: is present, but did not answer" in out


@pytest.mark.parametrize(("service", "instance"), [("other", "x"), ("thing", "\x1b[2J")])
def test_what_nobody_of_the_service_can_have_said_makes_nobody_ill(
    asked, router, service, instance
) -> None:
    stranger = Source.model_construct(service=service, instance=instance, boot="b")
    with Bus.open(BusSettings(router=router), "stranger", "s") as bus:
        key = bus.keys.rpc("thing", "x", "health")

        def pretend(query: zenoh.Query) -> None:
            with query:
                query.reply(key, encode(said(False), Envelope(source=stranger, seq=0)))

        bus._declared.append(bus._session.declare_queryable(key, pretend))
        assert asked({"a": said}) == (0, "")
