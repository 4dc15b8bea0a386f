"""The feed hands on every step once and in order, whatever the wire does."""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.keys import Keys
from hmcs.bus.messages import Envelope, LastSteps, LastStepsQuestion, Origin, Pairing, Source, Step
from hmcs.bus.session import Answer, Received
from hmcs.bus.step_feed import LARGEST_JUMP, PAIRING_FRESH_S, StepFeed
from hmcs.driving import TAKEOVER_S

MOVE = np.array([0.01, 0.0, 0.0])
S = 1_000_000_000
ORIGIN = Origin(boot="boot-1", seq=0, captured_ns=0)


def step(index: int) -> Step:
    return Step(index=index, position=index * MOVE, displacement=MOVE)


class FakeBus:
    """What a feed needs of a bus; `kept` are the steps the input device can be asked for."""

    def __init__(self, kept: range = range(0), boot: str = "boot-1") -> None:
        self.keys = Keys("cell")
        self.kept, self.boot, self.questions = kept, boot, []
        self.asked: list[str] = []
        """Keys of the questions."""
        self.hangs = False
        self.damage: dict[str, Any] = {}
        """Fields of its next answers that are otherwise than they should be."""
        self.refused: Counter[str] = Counter()
        self.counters = SimpleNamespace(count_refused=self._count_refused)
        self.handlers: dict[str, Callable[[Received[Any]], None]] = {}
        self.now_ns = time.monotonic_ns()

    def _count_refused(self, schema: str, reason: str) -> None:
        self.refused[schema] += 1

    def subscribe(self, _type: Any, key: str, handler: Callable[[Received[Any]], None]) -> None:
        self.handlers[key] = handler

    def ask(
        self, key: str, question: LastStepsQuestion, _type: Any, timeout_s: float
    ) -> list[Answer[LastSteps]]:
        self.questions.append(question)
        self.asked.append(key)
        if self.hangs:
            return []
        indices = [i for i in self.kept if question.before is None or i < question.before]
        chosen = indices[-question.count :]
        origin = Origin(boot=self.boot, seq=0, captured_ns=0)
        body = LastSteps(
            clock=self.boot,
            steps=tuple(step(i) for i in chosen),
            origins=(origin,) * len(chosen),
        )
        body = body.model_copy(update=self.damage)
        return [Answer(Envelope(source=self.source(), seq=0), body)]

    def source(self, instance: str = "a", boot: str | None = None) -> Source:
        return Source(service="input_device", instance=instance, boot=boot or self.boot)

    def hear(self, index: int, instance: str = "a", boot: str | None = None) -> None:
        envelope = Envelope(source=self.source(instance, boot), seq=index)
        key = self.keys.step
        self.handlers[key](Received(step(index), envelope, self.now_ns, key))

    def pair(self, device: str, instance: str = "a") -> None:
        source = Source(service="fixture_controller", instance="f", boot="boot-f")
        body = Pairing(device=device, device_instance=instance, robot="", robot_instance="")
        key = self.keys.pairing
        self.handlers[key](Received(body, Envelope(source=source, seq=0), self.now_ns, key))

    def wait(self, seconds: float) -> None:
        self.now_ns += round(seconds * S)


class Listener:
    """A feed on a fake bus, and what it handed on: ("restart", index) and ("step", index)."""

    def __init__(self, bus: FakeBus, memory_steps: int = 5) -> None:
        self.reported: list[tuple[str, int]] = []
        self.clocks: list[str] = []
        self.feed = StepFeed(
            bus,  # type: ignore[arg-type]
            logging.getLogger("test"),
            lambda fed: self._on_step(fed.step.index, fed.clock),
            lambda index: self.reported.append(("restart", index)),
            memory_steps=memory_steps,
        )
        self.feed.begin()

    def _on_step(self, index: int, clock: str) -> None:
        self.reported.append(("step", index))
        self.clocks.append(clock)

    @property
    def steps(self) -> list[int]:
        return [index for kind, index in self.reported if kind == "step"]


def test_who_is_there_from_the_beginning_gets_every_step_after_one_start() -> None:
    bus = FakeBus()
    listener = Listener(bus)
    for index in range(4):
        bus.hear(index)
    assert listener.reported == [("restart", 0), *(("step", k) for k in range(4))]
    assert not bus.refused


def test_who_comes_late_is_given_the_last_steps_first_and_none_of_them_twice() -> None:
    bus = FakeBus(kept=range(20))
    listener = Listener(bus, memory_steps=5)
    assert listener.reported == [("restart", 15), *(("step", k) for k in range(15, 20))]
    for index in (18, 19, 20, 21):
        bus.hear(index)
    assert listener.steps == list(range(15, 22))
    assert not bus.refused


def test_missed_steps_are_fetched_before_it_goes_on() -> None:
    bus = FakeBus()
    listener = Listener(bus)
    bus.hear(0)
    bus.kept = range(9)
    bus.hear(8)
    assert listener.reported == [("restart", 0), *(("step", k) for k in range(9))]
    assert (bus.questions[-1].count, bus.questions[-1].before) == (7, 8)


def test_a_gap_that_cannot_be_filled_is_a_new_beginning() -> None:
    bus = FakeBus()
    listener = Listener(bus)
    bus.hear(0)
    bus.hear(5)
    bus.hear(6)
    assert listener.reported[-3:] == [("restart", 5), ("step", 5), ("step", 6)]


def test_a_gap_that_can_be_filled_in_part_begins_anew_with_that_part() -> None:
    bus = FakeBus()
    listener = Listener(bus)
    bus.hear(0)
    bus.kept = range(6, 9)
    bus.hear(9)
    assert listener.reported[-5:] == [("restart", 6), *(("step", k) for k in range(6, 10))]


@pytest.mark.parametrize("again", [0, 2, 3])
def test_a_step_that_repeats_or_jumps_back_is_refused_and_counted(again: int) -> None:
    bus = FakeBus()
    listener = Listener(bus)
    for index in range(4):
        bus.hear(index)
    bus.hear(again)
    assert bus.refused["step"] == 1
    bus.hear(4)
    assert listener.steps == [0, 1, 2, 3, 4]


def test_an_input_device_that_starts_anew_starts_the_listener_anew() -> None:
    bus = FakeBus()
    listener = Listener(bus)
    bus.hear(0)
    bus.hear(1)
    bus.boot = "boot-2"
    bus.wait(TAKEOVER_S + 0.1)
    bus.hear(0)
    assert listener.reported[-2:] == [("restart", 0), ("step", 0)]
    assert listener.clocks == ["boot-1", "boot-1", "boot-2"]


def test_a_second_input_device_is_refused_while_the_first_is_alive_and_heard_after_it() -> None:
    bus = FakeBus()
    listener = Listener(bus)
    bus.hear(0)
    bus.hear(0, instance="b", boot="other")
    assert bus.refused["step"] == 1
    assert listener.steps == [0]
    bus.wait(TAKEOVER_S + 0.1)
    bus.hear(0, instance="b", boot="other")
    assert listener.clocks == ["boot-1", "other"]


def test_a_stray_step_right_after_catching_up_takes_nothing_over() -> None:
    bus = FakeBus(kept=range(50))
    listener = Listener(bus)
    bus.hear(0, instance="b", boot="other")
    bus.hear(0, instance="a", boot="another-boot-of-the-same-name")
    bus.hear(50)
    assert listener.steps == [*range(45, 51)]
    assert set(listener.clocks) == {"boot-1"}
    assert bus.refused["step"] == 2


def test_the_device_of_the_pairing_is_the_one_that_is_followed() -> None:
    bus = FakeBus()
    listener = Listener(bus)
    bus.pair("boot-1")
    bus.hear(0)
    bus.wait(10 * TAKEOVER_S)
    bus.pair("boot-1")
    bus.hear(0, instance="b", boot="other")
    assert bus.refused["step"] == 1
    bus.hear(1)
    assert listener.steps == [0, 1]


def test_a_pairing_with_another_device_begins_anew_with_the_last_steps_of_that() -> None:
    bus = FakeBus()
    listener = Listener(bus)
    bus.hear(0)
    bus.kept, bus.boot = range(7), "boot-b"
    bus.pair("boot-b", "b")
    assert listener.reported[-6:] == [("restart", 2), *(("step", k) for k in range(2, 7))]
    bus.hear(1, boot="boot-1")
    bus.hear(7, instance="b", boot="boot-b")
    assert listener.steps == [0, *range(2, 8)]
    assert listener.clocks == ["boot-1"] + ["boot-b"] * 6


def test_a_pairing_that_is_not_heard_again_says_nothing_any_more() -> None:
    bus = FakeBus()
    listener = Listener(bus)
    bus.pair("boot-1")
    bus.hear(0)
    bus.wait(PAIRING_FRESH_S + TAKEOVER_S)
    bus.hear(0, instance="b", boot="other")
    assert listener.clocks == ["boot-1", "other"]


def test_a_step_that_its_device_does_not_know_is_refused_and_those_after_it_are_not() -> None:
    bus = FakeBus()
    listener = Listener(bus)
    for index in range(3):
        bus.kept = range(index + 1)
        bus.hear(index)
    bus.hear(10**9)
    assert bus.refused["step"] == 1
    bus.kept = range(4)
    bus.hear(3)
    assert listener.steps == [0, 1, 2, 3]


def test_where_the_device_does_not_answer_only_a_jump_that_can_be_is_taken_over() -> None:
    bus = FakeBus()
    listener = Listener(bus)
    bus.hear(0)
    bus.hangs = True
    bus.hear(LARGEST_JUMP + 2)
    assert listener.steps == [0]
    bus.hear(9)
    assert listener.reported[-2:] == [("restart", 9), ("step", 9)]


def test_a_feed_ahead_of_its_device_begins_anew_with_what_the_device_says() -> None:
    bus = FakeBus()
    listener = Listener(bus)
    bus.hear(0)
    bus.hangs = True
    bus.hear(5000)
    bus.hangs = False
    for index in range(1, 4):
        bus.kept = range(index + 1)
        bus.hear(index)
    bus.wait(2.0)
    bus.kept = range(5)
    bus.hear(4)
    assert listener.reported[-5:] == [("step", k) for k in range(5)][-5:]
    bus.hear(5)
    assert listener.steps[-1] == 5


def test_the_device_that_is_followed_is_the_one_that_is_asked() -> None:
    bus = FakeBus()
    Listener(bus)
    assert "/input_device/*/" in bus.asked[-1]
    bus.hear(0, instance="a")
    bus.hear(5, instance="a")
    assert "/input_device/a/" in bus.asked[-1]
    bus.boot = "boot-b"
    bus.pair("boot-b", "b")
    assert "/input_device/b/" in bus.asked[-1]
    bus.hear(3, instance="b", boot="boot-b")
    assert "/input_device/b/" in bus.asked[-1]


def test_what_was_fetched_of_the_device_before_excuses_no_repeated_step_of_the_next() -> None:
    bus = FakeBus(kept=range(50))
    listener = Listener(bus)
    bus.kept, bus.boot = range(0), "boot-2"
    bus.wait(TAKEOVER_S + 0.1)
    for index in (0, 1, 2, 1):
        bus.hear(index)
    assert bus.refused["step"] == 1
    assert listener.steps[-3:] == [0, 1, 2]


def test_a_pairing_without_a_device_leaves_it_to_who_is_heard() -> None:
    bus = FakeBus()
    listener = Listener(bus)
    bus.pair("")
    bus.hear(0)
    assert listener.steps == [0]


def test_a_pairing_that_is_heard_again_changes_nothing() -> None:
    bus = FakeBus(kept=range(3))
    listener = Listener(bus)
    for _ in range(3):
        bus.pair("boot-1")
    bus.hear(3)
    assert listener.reported == [("restart", 0), *(("step", k) for k in range(4))]


def test_who_hears_a_late_step_first_is_given_as_many_before_it_as_it_remembers() -> None:
    bus = FakeBus()
    listener = Listener(bus, memory_steps=5)
    bus.kept = range(40)
    bus.hear(40)
    assert listener.reported == [("restart", 35), *(("step", k) for k in range(35, 41))]


def test_however_often_a_step_comes_again_its_device_is_asked_once_a_second() -> None:
    bus = FakeBus()
    Listener(bus)
    for index in range(4):
        bus.hear(index)
    asked = len(bus.questions)
    for _ in range(30):
        bus.hear(1)
    assert len(bus.questions) - asked == 1


DAMAGED: dict[str, dict[str, Any]] = {
    "a step is missing": {"steps": (step(4), step(6), step(7)), "origins": (ORIGIN,) * 3},
    "a sample is missing": {"origins": (ORIGIN,) * 4},
    "of another boot than its sender's": {"clock": "boot-x"},
}


@pytest.mark.parametrize("damage", DAMAGED.values(), ids=DAMAGED)
def test_an_answer_that_cannot_be_is_as_if_there_were_none(damage: dict[str, Any]) -> None:
    bus = FakeBus(kept=range(3))
    listener = Listener(bus)
    bus.kept, bus.damage = range(8), damage
    bus.hear(8)
    assert listener.reported[-2:] == [("restart", 8), ("step", 8)]
    assert listener.steps == [0, 1, 2, 8]
    assert Listener(bus).reported == []


@given(
    joined=st.integers(0, 12),
    heard=st.lists(st.integers(0, 25), max_size=30),
    memory=st.integers(1, 8),
)
def test_steps_are_consecutive_between_restarts_whatever_is_heard(
    joined: int, heard: list[int], memory: int
) -> None:
    bus = FakeBus(kept=range(joined))
    listener = Listener(bus, memory)
    for index in heard:
        bus.kept = range(max(joined, index))
        bus.hear(index)
    expected = None
    for kind, index in listener.reported:
        assert expected is None or index >= expected
        if kind == "step":
            assert index == expected
            expected = index + 1
        else:
            expected = index
