from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.mailbox import Arrival, EveryOne, Mailbox, NewestWins


def drain(mailbox: Mailbox) -> None:
    while (work := mailbox.take(0)) is not None:
        work()


def arrivals(keys: list[str]) -> list[Arrival]:
    return [Arrival(key, str(number).encode(), number) for number, key in enumerate(keys)]


@given(st.lists(st.sampled_from("abc")))
def test_every_one_hands_on_everything_in_order(keys) -> None:
    mailbox, got = Mailbox(), []
    box = EveryOne(mailbox, got.append, lambda: None)
    for arrival in arrivals(keys):
        box.arrive(arrival)
    drain(mailbox)
    assert got == arrivals(keys)


@given(st.lists(st.one_of(st.sampled_from("abc"), st.none())))
def test_newest_wins_hands_on_the_newest_of_each_key_and_accounts_for_the_rest(keys) -> None:
    mailbox, got, handed_in = Mailbox(), [], 0
    box = NewestWins(mailbox, got.append)
    newest: dict[str, bytes] = {}
    for number, key in enumerate([*keys, None]):
        if key is not None:
            box.arrive(Arrival(key, str(number).encode(), number))
            newest[key] = str(number).encode()
            handed_in += 1
            continue
        before = len(got)
        drain(mailbox)
        assert {arrival.key: arrival.payload for arrival in got[before:]} == newest
        newest.clear()
    assert sum(1 + arrival.overwritten for arrival in got) == handed_in


@given(st.integers(1, 5), st.integers(0, 12))
def test_every_one_is_bounded_and_says_once_that_it_overflows(bound, count) -> None:
    mailbox, got, overflows = Mailbox(), [], []
    box = EveryOne(mailbox, got.append, lambda: overflows.append(len(got)), bound=bound)
    for arrival in arrivals(["a"] * count):
        box.arrive(arrival)
    drain(mailbox)
    assert got == arrivals(["a"] * count)[:bound]
    assert len(overflows) == (count > bound)


def test_after_an_overflow_there_is_room_again() -> None:
    mailbox, got = Mailbox(), []
    box = EveryOne(mailbox, got.append, lambda: None, bound=1)
    for _ in range(2):
        box.arrive(Arrival("a", b"", 0))
        box.arrive(Arrival("a", b"", 0))
        drain(mailbox)
    assert len(got) == 2


def test_waking_ends_a_wait_with_nothing_to_do() -> None:
    mailbox = Mailbox()
    mailbox.wake()
    assert mailbox.take(60.0) is None


def test_of_two_senders_on_one_key_neither_takes_the_others_place() -> None:
    mailbox, got = Mailbox(), []
    box = NewestWins(mailbox, got.append)
    for number, sender in enumerate([b"one", b"two", b"one"]):
        box.arrive(Arrival("a", str(number).encode(), number, sender))
    drain(mailbox)
    assert [(arrival.sender, arrival.payload) for arrival in got] == [
        (b"one", b"2"),
        (b"two", b"1"),
    ]
    assert [arrival.overwritten for arrival in got] == [1, 0]
