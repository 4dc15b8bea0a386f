"""Commands that ask processes of the cell for something, and tell what each has done."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from hmcs.bus.messages import Ask, Message, Record
from hmcs.bus.session import Bus
from hmcs.bus.verbs import STOP
from hmcs_local.asking import NobodyAnswersError, PartlyAnsweredError, asked_of
from support.asked import CELL, Asked, announce, process

IMPOSSIBLE = ["evil name", "\x1b[2J\x1b]0;pwned\x07x", "n" * 300, "\u202egnp", "*", "-x"]


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
def test_what_is_asked_for_is_carried_out_by_all_and_reported(
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
def test_where_nobody_is_there_that_is_reported(
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
