from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.mailbox import SENDER_SHARE, Arrival, KeepAll, KeepLast, Mailbox


def drain(mailbox: Mailbox) -> None:
    while (work := mailbox.take(0)) is not None:
        work()


def arrivals(keys: list[str]) -> list[Arrival]:
    return [Arrival(key, str(number).encode(), number) for number, key in enumerate(keys)]


@given(st.lists(st.sampled_from("abc")))
def test_keep_all_hands_on_everything_in_order(keys) -> None:
    mailbox, got = Mailbox(), []
    box = KeepAll(mailbox, got.append, lambda: None)
    for arrival in arrivals(keys):
        box.arrive(arrival)
    drain(mailbox)
    assert got == arrivals(keys)


@given(st.lists(st.one_of(st.sampled_from("abc"), st.none())))
def test_keep_last_hands_on_the_newest_of_each_key_and_accounts_for_the_rest(keys) -> None:
    mailbox, got, handed_in = Mailbox(), [], 0
    box = KeepLast(mailbox, got.append)
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


@given(st.integers(1, 5), st.integers(0, 40))
def test_keep_all_is_bounded_and_says_once_that_it_overflows(share, count) -> None:
    mailbox, got, overflows = Mailbox(), [], []
    bound = share * SENDER_SHARE
    box = KeepAll(mailbox, got.append, lambda: overflows.append(len(got)), bound=bound)
    for arrival in arrivals(["a"] * count):
        box.arrive(arrival)
    drain(mailbox)
    assert got == arrivals(["a"] * count)[:share]
    assert len(overflows) == (count > share)


def test_the_flood_of_one_sender_leaves_room_for_another() -> None:
    mailbox, got = Mailbox(), []
    box = KeepAll(mailbox, got.append, lambda: None, bound=8)
    for number in range(100):
        box.arrive(Arrival("a", b"", number, b"flood"))
    honest = Arrival("a", b"", 100, b"honest")
    box.arrive(honest)
    drain(mailbox)
    assert honest in got
    assert len(got) == 3


def test_messages_that_wait_are_bounded_in_bytes_too_and_once_handled_make_room() -> None:
    mailbox, got = Mailbox(), []
    box = KeepAll(mailbox, got.append, lambda: None, bound_bytes=400)
    for _ in range(3):
        for number in range(100):
            box.arrive(Arrival("a", bytes(30), number))
        drain(mailbox)
    assert [arrival.received_ns for arrival in got] == [0, 1, 2] * 3


def test_keep_last_keeps_of_so_many_senders_and_says_once_that_it_overflows() -> None:
    mailbox, got, overflows = Mailbox(), [], []
    box = KeepLast(mailbox, got.append, lambda: overflows.append(1), most_senders=3)
    for number in range(10):
        box.arrive(Arrival("a", b"", number, str(number).encode()))
    box.arrive(Arrival("a", b"", 10, b"0"))
    drain(mailbox)
    assert [arrival.sender for arrival in got] == [b"0", b"1", b"2"]
    assert got[0].received_ns == 10
    assert overflows == [1]
    box.arrive(Arrival("a", b"", 11, b"9"))
    drain(mailbox)
    assert got[-1].received_ns == 11


def test_after_an_overflow_there_is_room_again() -> None:
    mailbox, got = Mailbox(), []
    box = KeepAll(mailbox, got.append, lambda: None, bound=1)
    for _ in range(2):
        for _ in range(2):
            box.arrive(Arrival("a", b"", 0))
        drain(mailbox)
    assert len(got) == 2


def test_waking_ends_a_wait_with_nothing_to_do() -> None:
    mailbox = Mailbox()
    mailbox.wake()
    assert mailbox.take(60.0) is None


def test_of_two_senders_on_one_key_neither_takes_the_others_place() -> None:
    mailbox, got = Mailbox(), []
    box = KeepLast(mailbox, got.append)
    for number, sender in enumerate([b"one", b"two", b"one"]):
        box.arrive(Arrival("a", str(number).encode(), number, sender))
    drain(mailbox)
    assert [(arrival.sender, arrival.payload) for arrival in got] == [
        (b"one", b"2"),
        (b"two", b"1"),
    ]
    assert [arrival.overwritten for arrival in got] == [1, 0]
