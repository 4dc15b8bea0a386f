"""Every robot that can stand does, whatever becomes of the others."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import pytest
import zenoh

from hmcs.bus.config import BusSettings
from hmcs.bus.keys import ANY, Member
from hmcs.bus.messages import Ask, Done, Envelope, Source
from hmcs.bus.session import Bus
from hmcs.bus.wire import encode
from hmcs_local import asking
from hmcs_local.asking import stop_everybody
from support.asked import CELL, Asked, announce, process

Eventually = Callable[[Callable[[], Any]], Any]


@pytest.mark.long
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


def test_a_robot_that_hangs_is_reported_and_the_others_stand(
    observer: Bus, robot: Callable[..., Asked], seen: Callable[[int], None]
) -> None:
    robot("a", hangs=True)
    well = robot("b")
    seen(2)
    replies = stop_everybody(observer, 0.5)
    assert list(map(str, replies.each)) == ["a: did not answer within 0.5 s", "b: stop is done"]
    assert not replies.all_done
    assert well


def test_a_robot_whose_presence_is_not_known_stands_and_is_reported(
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


def test_trouble_with_one_robot_is_reported_as_its_own(
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
