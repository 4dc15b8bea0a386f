"""Commands that ask processes of the cell for something: all at once, and each one is heard."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import numpy as np
import pytest
import zenoh

from hmcs.bus.config import BusSettings
from hmcs.bus.keys import ANY, Member
from hmcs.bus.messages import (
    Ask,
    Done,
    Envelope,
    Label,
    LastSteps,
    LastStepsQuestion,
    Message,
    Origin,
    Record,
    Source,
    Step,
)
from hmcs.bus.router import open_router
from hmcs.bus.session import Bus, RequestRefusedError
from hmcs.bus.verbs import STOP
from hmcs.bus.wire import encode
from hmcs_local import asking
from hmcs_local.asking import NobodyAnswersError, PartlyAnsweredError, asked_of, stop_everybody
from hmcs_local.connecting import open_operator
from hmcs_local.stack import with_free_port

CELL = "asked"
Asked = list[tuple[str, Message]]
Eventually = Callable[[Callable[[], Any]], Any]
IMPOSSIBLE = ["evil name", "\x1b[2J\x1b]0;pwned\x07x", "n" * 300, "\u202egnp", "*", "-x"]


@pytest.fixture
def router() -> Iterator[str]:
    endpoint = with_free_port("tcp/127.0.0.1:0")
    with open_router(endpoint):
        yield endpoint


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


@pytest.fixture
def robot(router: str) -> Iterator[Callable[..., Asked]]:
    """Bring up robots until the test ends."""
    with ExitStack() as up:
        yield lambda instance, **how: up.enter_context(
            process(router, "robot", {"stop": Ask}, instance=instance, **how)
        )


@pytest.fixture
def observer(router: str) -> Iterator[Bus]:
    with open_operator(router, CELL) as bus:
        # It shows the tokens of others as well.
        bus.rights = None
        yield bus


@pytest.fixture
def seen(observer: Bus, eventually: Eventually) -> Callable[[int], None]:
    """Wait until so many tokens of presence are there."""

    def shown() -> int:
        there = observer.present(observer.keys.presence())
        return len(there.tokens) + len(there.strangers)

    return lambda count: eventually(lambda: shown() == count)


def announce(observer: Bus, service: str, name: str) -> None:
    observer.announce(observer.keys.presence(service, "x").removesuffix("x") + name)


@pytest.mark.parametrize(
    ("words", "service", "verb", "body"),
    [
        (("stop",), "robot", "stop", Ask()),
        (("play",), "input_device", "play", Ask()),
        (("cancel",), "trainer", "cancel", Ask()),
        (("record", "take-1"), "recorder", "record", Record(on=True, name="take-1")),
        (("record", "--stop"), "recorder", "record", Record(on=False)),
    ],
)
def test_what_is_asked_for_is_carried_out_by_all_and_told(
    hmcs: Any,
    router: str,
    seen: Callable[[int], None],
    words: tuple[str, ...],
    service: str,
    verb: str,
    body: Message,
) -> None:
    answers = {verb: type(body)}
    with (
        process(router, service, answers, instance="one") as one,
        process(router, service, answers, instance="two") as two,
    ):
        seen(2)
        ended = hmcs(*words, "--router", router, "--cell", CELL)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout == f"one: {verb} is done\ntwo: {verb} is done\n"
    for asked in (one, two):
        assert asked[0] == (verb, body)
        assert len(asked) == 1 or verb == "stop"


@pytest.mark.parametrize(
    ("word", "service", "question"),
    [
        ("stop", "robot", Ask),
        ("play", "input_device", Ask),
        ("cancel", "trainer", Ask),
        ("record", "recorder", Record),
    ],
)
def test_one_that_refuses_or_is_a_name_only_keeps_nobody_else_from_doing_it(
    hmcs: Any,
    router: str,
    observer: Bus,
    seen: Callable[[int], None],
    word: str,
    service: str,
    question: type[Message],
) -> None:
    announce(observer, service, "a-ghost")
    with (
        process(router, service, {word: question}, refusal="not now", instance="b") as refusing,
        process(router, service, {word: question}, instance="c") as asked,
    ):
        seen(3)
        ended = hmcs(word, "--router", router, "--cell", CELL)
    assert ended.returncode == 1
    assert ended.stdout == f"c: {word} is done\n"
    ghost, refused = ended.stderr.splitlines()
    assert ghost.startswith("a-ghost: did not answer within")
    assert refused == "b: refused: not now"
    assert asked
    assert refusing


@pytest.mark.parametrize(
    ("word", "service"), [("stop", "robot"), ("cancel", "trainer"), ("record", "recorder")]
)
def test_where_nobody_is_there_that_is_told(
    hmcs: Any, router: str, observer: Bus, seen: Callable[[int], None], word: str, service: str
) -> None:
    ended = hmcs(word, "--router", router, "--cell", CELL)
    assert ended.returncode == 2
    assert f"no {service} in cell {CELL}: start one" in ended.stderr
    announce(observer, service, "evil name")
    seen(1)
    ended = hmcs(word, "--router", router, "--cell", CELL)
    assert ended.returncode == 2
    assert "left out, since no process can bear such a name (1): " in ended.stderr


@pytest.mark.parametrize(
    ("word", "service", "question"),
    [("stop", "robot", Ask), ("cancel", "trainer", Ask), ("record", "recorder", Record)],
)
def test_names_nobody_can_bear_are_counted_shown_harmlessly_and_ask_for_nothing(
    hmcs: Any,
    router: str,
    observer: Bus,
    seen: Callable[[int], None],
    word: str,
    service: str,
    question: type[Message],
) -> None:
    for name in IMPOSSIBLE[:4]:
        announce(observer, service, name)
    with process(router, service, {word: question}):
        seen(5)
        ended = hmcs(word, "--router", router, "--cell", CELL)
    assert (ended.returncode, ended.stdout) == (0, f"it: {word} is done\n")
    assert "no process can bear such a name (4): " in ended.stderr
    assert ended.stderr.removesuffix("\n").isprintable()
    assert len(ended.stderr) < 300


def test_what_a_process_answers_is_shown_harmlessly(
    hmcs: Any, router: str, robot: Callable[..., Asked], seen: Callable[[int], None]
) -> None:
    robot("it", detail="\x1b[2Jstands\u202e" + "x" * 10_000)
    seen(1)
    ended = hmcs("stop", "--router", router, "--cell", CELL)
    assert ended.returncode == 0
    assert ended.stdout.startswith("it: \\x1b[2Jstands\\u202exxx")
    assert len(ended.stdout) < 1000


def test_robots_that_hang_keep_no_robot_moving(
    router: str,
    observer: Bus,
    robot: Callable[..., Asked],
    seen: Callable[[int], None],
    eventually: Eventually,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Even where they would have to be asked one after another.
    monkeypatch.setattr(asking, "_ASKED_AT_ONCE", 1)
    well = robot("z")
    hung = [process(router, "robot", {"stop": Ask}, instance=f"a{k}", hangs=True) for k in "123"]
    with ExitStack() as up:
        for each in hung:
            up.enter_context(each)
        seen(4)
        result = []
        stopping = threading.Thread(target=lambda: result.append(stop_everybody(observer, 4)))
        stopping.start()
        try:
            eventually(lambda: well)
            assert not result, "the ones that hang are still being waited for"
        finally:
            stopping.join()
    assert {reply.member.instance: reply.done for reply in result[0].each}["z"]


def test_a_robot_that_hangs_is_told_and_the_others_stand(
    observer: Bus, robot: Callable[..., Asked], seen: Callable[[int], None]
) -> None:
    robot("a", hangs=True)
    well = robot("b")
    seen(2)
    replies = stop_everybody(observer, 0.5)
    assert list(map(str, replies.each)) == ["a: did not answer within 0.5 s", "b: stop is done"]
    assert not replies.all_done
    assert well


def test_a_robot_whose_presence_is_not_known_stands_and_is_told(
    observer: Bus, robot: Callable[..., Asked], eventually: Eventually
) -> None:
    robot("hidden", is_present=False)
    key = observer.keys.rpc("robot", ANY, "stop")
    eventually(lambda: observer.ask(key, Ask(), Done))
    replies = stop_everybody(observer, 1.0)
    assert list(map(str, replies.each)) == ["hidden: stop is done"]


def test_a_robot_that_cannot_be_reached_yet_is_asked_again(
    observer: Bus, robot: Callable[..., Asked], seen: Callable[[int], None]
) -> None:
    announce(observer, "robot", "late")
    seen(1)
    result = []
    stopping = threading.Thread(target=lambda: result.append(stop_everybody(observer, 30)))
    stopping.start()
    robot("late")
    stopping.join()
    assert result[0].all_done


@pytest.mark.parametrize(
    ("service", "instance"), [("robot", "other"), ("attacker", "a"), ("attacker", "x")]
)
def test_one_that_answers_in_a_robots_place_is_not_that_robot(
    router: str,
    observer: Bus,
    robot: Callable[..., Asked],
    seen: Callable[[int], None],
    service: str,
    instance: str,
) -> None:
    robot("a", hangs=True)
    key = observer.keys.rpc("robot", "a", "stop")

    def pretend(query: zenoh.Query) -> None:
        source = Source(service=service, instance=instance, boot="b")
        with query:
            query.reply(key, encode(Done(detail="stands"), Envelope(source=source, seq=0)))

    with Bus.open(BusSettings(router=router, cell=CELL), "stranger", "s") as stranger:
        stranger._declared.append(stranger._session.declare_queryable(key, pretend))
        seen(1)
        replies = {r.member: r.done for r in stop_everybody(observer, 0.5).each}
    assert replies.pop(Member("robot", "a")) is False
    assert all(member.service == "robot" for member in replies)


def test_trouble_with_one_robot_is_told_as_its_own(
    observer: Bus,
    robot: Callable[..., Asked],
    seen: Callable[[int], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot("a")
    robot("b")
    seen(2)
    ask = observer.ask

    def fail(key: str, *rest: Any, **named: Any) -> Any:
        if "/b/" not in key:
            raise zenoh.ZError("no memory")
        return ask(key, *rest, **named)

    monkeypatch.setattr(observer, "ask", fail)
    replies = stop_everybody(observer, 0.5)
    assert list(map(str, replies.each)) == [
        "a: could not be asked: ZError: no memory",
        "b: stop is done",
    ]


def test_what_all_of_a_service_did_is_one_line_and_what_some_did_is_an_error(
    observer: Bus, robot: Callable[..., Asked], seen: Callable[[int], None]
) -> None:
    with pytest.raises(NobodyAnswersError, match="no robot in cell asked"):
        asked_of(observer, STOP, Ask())
    robot("b")
    seen(1)
    assert asked_of(observer, STOP, Ask()) == "stop is done"
    announce(observer, "robot", "a")
    seen(2)
    with pytest.raises(PartlyAnsweredError, match=r"a: did not answer.*; b: stop is done"):
        asked_of(observer, STOP, Ask())
    robot("c", refusal="not now")
    seen(3)
    with pytest.raises(NobodyAnswersError, match="c: refused: not now") as refused:
        asked_of(observer, STOP, Ask())
    assert not isinstance(refused.value, PartlyAnsweredError)


# --- hmcs mark ------------------------------------------------------------------------------------


@contextmanager
def device(router: str, instance: str, steps: int) -> Iterator[str]:
    """An input device that has made so many steps; yields its clock."""
    over = threading.Event()
    with Bus.open(BusSettings(router=router, cell=CELL), "input_device", instance) as bus:
        last = Step(index=max(steps - 1, 0), position=np.zeros(3), displacement=np.ones(3))
        said = LastSteps(
            clock=bus.source.boot,
            steps=(last,) if steps else (),
            origins=(Origin(boot="b", seq=0, captured_ns=0),) if steps else (),
        )
        bus.answer("last_steps", LastStepsQuestion, lambda _: said)

        def live() -> None:
            while not over.is_set():
                bus.pump(0.01)

        thread = threading.Thread(target=live)
        thread.start()
        try:
            yield bus.source.boot
        finally:
            over.set()
            thread.join()


def test_what_is_marked_is_heard(hmcs: Any, router: str) -> None:
    with process(router, "recorder", {}) as asked:
        ended = hmcs("mark", "approach", "--router", router, "--cell", CELL)
    assert (ended.returncode, asked) == (0, [("label", Label(state="approach"))])


@pytest.mark.parametrize("idle_too", [False, True])
def test_what_is_marked_is_said_of_the_next_step_of_the_device_that_makes_steps(
    hmcs: Any, router: str, idle_too: bool
) -> None:
    with ExitStack() as up:
        asked = up.enter_context(process(router, "recorder", {}))
        if idle_too:
            up.enter_context(device(router, "a-idle", 0))
        clock = up.enter_context(device(router, "b-hand", 7))
        ended = hmcs("mark", "approach", "--router", router, "--cell", CELL)
    assert ended.stdout == "approach from step 7 on\n"
    assert asked == [("label", Label(state="approach", clock=clock, step=7))]


def test_with_two_hands_in_motion_what_is_marked_is_said_of_this_moment(
    hmcs: Any, router: str
) -> None:
    with (
        process(router, "recorder", {}) as asked,
        device(router, "a", 3),
        device(router, "b", 9),
    ):
        ended = hmcs("mark", "approach", "--router", router, "--cell", CELL)
    assert "approach from now on, since 2 input devices make steps" in ended.stdout
    assert asked == [("label", Label(state="approach"))]


def test_where_nobody_writes_down_what_is_marked_that_is_told(hmcs: Any, router: str) -> None:
    ended = hmcs("mark", "approach", "--router", router, "--cell", CELL)
    assert ended.returncode == 2
    assert "start a recorder" in ended.stderr
