"""Processes of a cell that do what they are asked, refuse, or hang."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from hmcs.bus.config import BusSettings
from hmcs.bus.messages import Done, Label, Message
from hmcs.bus.session import Bus, RequestRefusedError

CELL = "asked"
Asked = list[tuple[str, Message]]


@contextmanager
def process(
    router: str,
    service: str,
    answers: dict[str, type[Message]],
    refusal: str = "",
    *,
    instance: str = "it",
    hangs: bool = False,
    is_present: bool = True,
    detail: str = "",
) -> Iterator[Asked]:
    """A process that does what it is asked, or refuses, or hangs; yields what it was asked."""
    asked: Asked = []

    def carry_out(verb: str) -> Callable[[Any], Done]:
        def answer(question: Message) -> Done:
            asked.append((verb, question))
            if refusal:
                raise RequestRefusedError(refusal)
            return Done(detail=detail or f"{verb} is done")

        return answer

    with Bus.open(BusSettings(router=router, cell=CELL), service, instance) as bus:
        for verb, question_type in answers.items():
            bus.answer(verb, question_type, carry_out(verb))
        bus.subscribe(Label, bus.keys.label, lambda got: asked.append(("label", got.body)))
        if is_present:
            bus.announce(bus.keys.presence(service, instance))
        ended = threading.Event()

        def live() -> None:
            while not ended.is_set():
                if not hangs:
                    bus.pump(0.01)
                ended.wait(0.01)

        thread = threading.Thread(target=live)
        thread.start()
        try:
            yield asked
        finally:
            ended.set()
            thread.join()


def announce(observer: Bus, service: str, name: str) -> None:
    observer.announce(observer.keys.presence(service, "x").removesuffix("x") + name)
