from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor

import pytest

from hmcs.bus.messages import ActivateRecognizer, Ask, Done, Health
from hmcs.bus.session import Bus, BusSettings, RequestRefusedError, StoppedError
from hmcs.errors import UserError


@pytest.fixture
def served(join) -> Iterator[Callable[..., Bus]]:
    """Buses pumped in threads of their own; what their handlers raise is kept in `failures`."""
    done = threading.Event()
    threads: list[threading.Thread] = []

    def serve(
        instance: str, handler: Callable, verb: str = "activate", aside: Executor | None = None
    ) -> Bus:
        bus = join("robot", instance)
        bus.answer(verb, ActivateRecognizer, handler, aside=aside)
        bus.failures = []  # type: ignore[attr-defined]

        def live() -> None:
            while not done.is_set():
                try:
                    bus.pump(0.02)
                except Exception as error:
                    bus.failures.append(error)  # type: ignore[attr-defined]

        threads.append(threading.Thread(target=live))
        threads[-1].start()
        return bus

    yield serve
    done.set()
    for thread in threads:
        thread.join()


def refuse(question: ActivateRecognizer) -> Done:
    raise RequestRefusedError(f"no model named {question.model!r}: load one of demo, lines")


@pytest.fixture
def asker(join) -> Bus:
    return join("asker")


def ask(asker: Bus, instance: str, until, count: int = 1, **options):
    """Ask once the answerers are known to the router."""
    key = asker.keys.rpc("robot", instance, "activate")
    answers: list = []

    def came() -> bool:
        answers[:] = asker.ask(key, ActivateRecognizer(model="demo"), Done, **options)
        return len(answers) >= count

    until(came)
    return answers


def test_an_answer_comes_with_its_envelope(served, asker, until) -> None:
    robot = served("a", lambda question: Done(detail=f"following {question.model}"))
    (answer,) = ask(asker, "a", until)
    assert answer.body == Done(detail="following demo")
    assert answer.envelope.source == robot.source


def test_everybody_asked_answers(served, asker, until) -> None:
    for instance in ("a", "b", "c"):
        served(instance, lambda _, name=instance: Done(detail=name))
    answers = ask(asker, "*", until, count=3)
    assert sorted(answer.body.detail for answer in answers) == ["a", "b", "c"]


def test_who_asks_everybody_is_not_asked_itself(served, join, until) -> None:
    served("b", lambda _: Done(detail="b"))
    asker = join("robot", "a")
    asked: list[ActivateRecognizer] = []

    def answered(question: ActivateRecognizer) -> Done:
        asked.append(question)
        return Done(detail="a")

    with ThreadPoolExecutor(1) as aside:
        asker.answer("activate", ActivateRecognizer, answered, aside=aside)
        answers = ask(asker, "*", until)
    assert [answer.body.detail for answer in answers] == ["b"]
    assert not asked


def test_nobody_there_is_no_answer(asker) -> None:
    assert asker.ask(asker.keys.rpc("robot", "a", "activate"), Ask(), Done) == []


def test_one_that_does_not_answer_in_time_is_no_answer(join, asker, until) -> None:
    hung = join("robot", "a")
    hung.answer("activate", ActivateRecognizer, lambda _: Done(detail="late"))
    key = asker.keys.rpc("robot", "a", "activate")
    # The question is known to be there once it waits in the mailbox of the one that never pumps.
    until(
        lambda: (
            asker.ask(key, ActivateRecognizer(model="m"), Done, timeout_s=0.05) == []
            and hung._mailbox.pending() > 0
        )
    )


@pytest.mark.parametrize("kind", [RequestRefusedError, UserError])
def test_a_refusal_reaches_the_asker_with_its_reason(served, asker, until, kind) -> None:
    def handler(question: ActivateRecognizer) -> Done:
        raise kind(f"no model named {question.model}")

    served("a", handler)
    with pytest.raises(RequestRefusedError, match="no model named demo"):
        ask(asker, "a", until)


def test_where_many_are_asked_those_that_refuse_are_left_out(served, asker, until) -> None:
    served("a", refuse)
    served("b", lambda _: Done(detail="b"))
    assert [answer.body.detail for answer in ask(asker, "*", until)] == ["b"]


def test_an_unexpected_failure_refuses_and_leaves_the_pump(served, asker, until) -> None:
    def handler(_: ActivateRecognizer) -> Done:
        raise ZeroDivisionError("inside")

    robot = served("a", handler)
    with pytest.raises(RequestRefusedError, match="see the log"):
        ask(asker, "a", until)
    until(lambda: robot.failures)
    assert isinstance(robot.failures[0], ZeroDivisionError)


def test_an_answer_made_aside_holds_nobody_up(served, asker, until) -> None:
    ticked = threading.Event()

    def handler(_: ActivateRecognizer) -> Done:
        # It is given only once the answering process has done something else meanwhile.
        return Done(detail="" if ticked.wait(10.0) else "held up")

    with ThreadPoolExecutor(1) as aside:
        robot = served("a", handler, aside=aside)
        robot.every(0.01, ticked.set)
        (answer,) = ask(asker, "a", until, timeout_s=15.0)
    assert answer.body.detail == ""


def test_an_unexpected_failure_aside_refuses_and_leaves_the_pump(served, asker, until) -> None:
    def handler(_: ActivateRecognizer) -> Done:
        raise ZeroDivisionError("inside")

    with ThreadPoolExecutor(1) as aside:
        robot = served("a", handler, aside=aside)
        with pytest.raises(RequestRefusedError, match="see the log"):
            ask(asker, "a", until)
        until(lambda: robot.failures)
    assert isinstance(robot.failures[0], ZeroDivisionError)


def test_a_question_of_another_kind_is_refused_and_counted(served, asker, until) -> None:
    robot = served("a", lambda _: Done(detail=""))
    ask(asker, "a", until)
    with pytest.raises(RequestRefusedError, match=r"'ask/1', expected 'activate_recognizer/1'"):
        asker.ask(asker.keys.rpc("robot", "a", "activate"), Ask(), Done)
    assert robot.counters.refused == {"activate_recognizer": 1}


def test_an_answer_of_another_kind_is_refused_and_counted(served, asker, until) -> None:
    served("a", lambda _: Done(detail=""))
    ask(asker, "a", until)
    key = asker.keys.rpc("robot", "a", "activate")
    assert asker.ask(key, ActivateRecognizer(model="m"), Health) == []
    assert asker.counters.refused == {"health": 1}


def test_a_process_that_asks_everybody_does_not_wait_for_itself(served, join, until) -> None:
    one = join("robot", "one")
    one.answer("activate", ActivateRecognizer, lambda _: Done(detail="me"))
    served("two", lambda _: Done(detail="two"))
    assert [answer.body.detail for answer in ask(one, "*", until)] == ["two"]


def test_asking_ends_when_the_process_is_asked_to_stop(router, join) -> None:
    hung = join("robot", "a")
    hung.answer("activate", ActivateRecognizer, lambda _: Done(detail=""))
    with Bus.open(
        BusSettings(router=router, cell="test"),
        "asker",
        "a",
        stopping=lambda: hung._mailbox.pending() > 0,
    ) as asker:
        key = asker.keys.rpc("robot", "a", "activate")

        def ask_on() -> None:
            while True:
                asker.ask(key, ActivateRecognizer(model="m"), Done, timeout_s=30.0)

        with pytest.raises(StoppedError):
            ask_on()
