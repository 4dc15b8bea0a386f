"""Commands that ask a process of the cell for something, against one that answers."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from hmcs.bus.config import BusSettings
from hmcs.bus.messages import Ask, Done, Label, Message, Record
from hmcs.bus.router import open_router
from hmcs.bus.session import Bus, RequestRefusedError
from hmcs_local.stack import with_free_port

CELL = "asked"
Asked = list[tuple[str, Message]]


@pytest.fixture
def router() -> Iterator[str]:
    endpoint = with_free_port("tcp/127.0.0.1:0")
    with open_router(endpoint):
        yield endpoint


@contextmanager
def process(
    router: str, service: str, answers: dict[str, type[Message]], refusal: str = ""
) -> Iterator[Asked]:
    """A process that does whatever it is asked, or refuses; yields what it was asked."""
    asked: Asked = []

    def carry_out(verb: str) -> Callable[[Any], Done]:
        def answer(question: Message) -> Done:
            asked.append((verb, question))
            if refusal:
                raise RequestRefusedError(refusal)
            return Done(detail=f"{verb} is done")

        return answer

    with Bus.open(BusSettings(router=router, cell=CELL), service, "it") as bus:
        for verb, question_type in answers.items():
            bus.answer(verb, question_type, carry_out(verb))
        bus.subscribe(Label, bus.keys.label, lambda got: asked.append(("label", got.body)))
        bus.announce(bus.keys.presence(service, "it"))
        ended = threading.Event()

        def live() -> None:
            while not ended.is_set():
                bus.pump(0.01)

        thread = threading.Thread(target=live)
        thread.start()
        try:
            yield asked
        finally:
            ended.set()
            thread.join()


@pytest.mark.parametrize(
    ("words", "service", "verb", "body"),
    [
        (("stop",), "robot", "stop", Ask()),
        (("cancel",), "trainer", "cancel", Ask()),
        (("record", "take-1"), "recorder", "record", Record(on=True, name="take-1")),
        (("record", "--stop"), "recorder", "record", Record(on=False)),
    ],
)
def test_what_is_asked_for_is_carried_out_and_told(
    hmcs: Any, router: str, words: tuple[str, ...], service: str, verb: str, body: Message
) -> None:
    with process(router, service, {verb: type(body)}) as asked:
        ended = hmcs(*words, "--router", router, "--cell", CELL)
    assert (ended.returncode, ended.stdout) == (0, f"{verb} is done\n")
    assert asked == [(verb, body)]


def test_what_is_marked_is_heard(hmcs: Any, router: str) -> None:
    with process(router, "recorder", {}) as asked:
        ended = hmcs("mark", "approach", "--router", router, "--cell", CELL)
    assert (ended.returncode, asked) == (0, [("label", Label(state="approach"))])


@pytest.mark.parametrize(
    ("word", "service"), [("stop", "robot"), ("cancel", "trainer"), ("record", "recorder")]
)
def test_where_nobody_is_there_or_it_refuses_that_is_told(
    hmcs: Any, router: str, word: str, service: str
) -> None:
    ended = hmcs(word, "--router", router, "--cell", CELL)
    assert ended.returncode == 2
    assert f"no {service} in cell {CELL}: start one" in ended.stderr
    question_type = Record if word == "record" else Ask
    with process(router, service, {word: question_type}, refusal="not now"):
        ended = hmcs(word, "--router", router, "--cell", CELL)
    assert (ended.returncode, ended.stderr) == (2, "hmcs: it: not now\n")
