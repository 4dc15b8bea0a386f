"""Whatever a page sends: bounded, in order, and what ends a motion comes through."""

from __future__ import annotations

import threading
from collections import defaultdict
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hmcs_console.operating.handles import (
    Alive,
    Clutched,
    Event,
    Gone,
    Grabbed,
    LetGo,
    Moved,
    Operating,
    Pedaled,
    Ruled,
    Stopped,
    after,
)
from hmcs_console.operating.rules import Rule
from hmcs_console.serving.inbox import BOUND, Inbox, Press, pressed_by

CLIENTS = (1, 2, 3)
SMALL = 4
"""Bound of an inbox that is soon full."""


def point(x: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([x, 0.0, 0.0])


clients = st.sampled_from(CLIENTS)
places = st.integers(0, 99).map(float)
events = st.one_of(
    st.builds(lambda client, x: Grabbed(client, 1.0, point(x)), clients, places),
    st.builds(lambda client, x: Moved(client, 1.0, point(x)), clients, places),
    st.builds(LetGo, clients),
    st.builds(Gone, clients),
    st.builds(Alive, clients, st.just(1.0)),
    st.builds(Clutched, clients, st.booleans()),
    st.builds(Pedaled, clients, st.just(1.0)),
    st.builds(lambda client, scale: Ruled(client, Rule(scale=scale)), clients, st.floats(0.1, 2)),
    st.builds(Stopped),
)


def in_time(history: list[Event]) -> list[Event]:
    """Give every event a later time than those before it, as a clock does."""
    return [
        event._replace(at_s=float(number)) if isinstance(event, Alive | Moved | Grabbed) else event
        for number, event in enumerate(history)
    ]


histories = st.lists(events, max_size=200).map(in_time)


def press() -> None:
    """Do nothing."""


def taken(history: list[Event], bound: int = SMALL) -> list[Any]:
    inbox = Inbox(bound)
    for event in history:
        inbox.put(event)
    return list(inbox.take().events)


def led(history: list[Any]) -> Operating:
    operating = Operating("desk")
    for event in history:
        operating = after(operating, event).operating
    return operating


def same(one: Event | Press, other: Event | Press) -> bool:
    return type(one) is type(other) and repr(one) == repr(other)


@given(history=histories)
def test_what_is_not_too_much_leads_to_what_all_of_it_would(history: list[Event]) -> None:
    all_of_it, kept = led(history), led(taken(history, bound=len(history) + 1))
    assert kept.lease == all_of_it.lease
    assert repr(kept.grip) == repr(all_of_it.grip)
    assert (kept.rules, kept.clutched) == (all_of_it.rules, all_of_it.clutched)
    if kept.lease.client is not None:
        assert repr(kept.position) == repr(all_of_it.position)


@given(history=histories)
def test_the_last_position_is_always_reported(history: list[Event]) -> None:
    kept = taken([Grabbed(1, 1.0, point(0)), *history, Moved(1, 1.0, point(123))])
    moves = [event for event in kept if isinstance(event, Moved) and event.client == 1]
    assert moves[-1].position[0] == 123


@given(history=histories, end=st.sampled_from((LetGo(1), Gone(1), Stopped())))
def test_a_release_always_comes_through(history: list[Event], end: Event) -> None:
    assert led(taken([Grabbed(1, 1.0, point(0)), *history, end])).lease.client != 1


@given(history=histories)
def test_nothing_overtakes_what_is_no_position(history: list[Event]) -> None:
    kept = taken(history, bound=len(history) + 1)
    for client in CLIENTS:
        mine = [event for event in kept if getattr(event, "client", client) == client]
        mine = [event for event in mine if not isinstance(event, Alive)]
        remaining = iter(history)
        assert all(any(same(event, other) for other in remaining) for event in mine)


@given(floods=st.lists(st.tuples(events, st.integers(1, 300)), max_size=10))
def test_what_is_kept_is_bounded(floods: list[tuple[Event, int]]) -> None:
    for history in (
        [event for event, times in floods for _ in range(times)],
        [event for _ in range(300) for event, _ in floods],
    ):
        counted = len(CLIENTS) * SMALL
        ends = counted + 1 + 2 * (counted + len(CLIENTS))
        # After each of them every page may have a position and a sign of life.
        assert len(taken(history)) <= (counted + ends + 1) * (1 + 2 * len(CLIENTS))


@given(history=histories, flood=st.lists(events, min_size=1, max_size=4))
def test_a_flood_leaves_others_events_alone(history: list[Event], flood: list[Event]) -> None:
    calm = [event for event in history if getattr(event, "client", None) == 2]
    mine = [event for event in flood if getattr(event, "client", None) == 1]
    mixed = [event for other in calm for event in (*mine * 5, other)]
    others = [event for event in taken(mixed) if event.client == 2]
    assert list(map(repr, others)) == list(map(repr, taken(calm)))


@given(history=histories)
def test_what_is_too_much_is_counted_by_page(history: list[Event]) -> None:
    inbox = Inbox(SMALL)
    counted: defaultdict[int, int] = defaultdict(int)
    for event in history:
        inbox.put(event)
        if isinstance(event, Grabbed | Clutched | Pedaled | Ruled):
            counted[event.client] += 1
    over = {client: count - SMALL for client, count in counted.items() if count > SMALL}
    assert inbox.take().dropped == over
    assert inbox.take() == ((), {})


def test_presses_are_bounded_by_the_page_they_are_of() -> None:
    inbox = Inbox()
    with pressed_by(1):
        for _ in range(BOUND + 7):
            inbox.put(press)
    with pressed_by(2):
        inbox.put(press)
    inbox.put(press)
    kept = inbox.take()
    assert len(kept.events) == BOUND + 2
    assert kept.dropped == {1: 7}


def test_presses_of_two_pages_at_once_keep_their_names() -> None:
    inbox, both = Inbox(), threading.Barrier(2)

    def flood(client: int, times: int) -> None:
        with pressed_by(client):
            both.wait(10.0)
            for _ in range(times):
                inbox.put(press)

    threads = [
        threading.Thread(target=flood, args=(client, times)) for client, times in ((1, 60), (2, 51))
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert inbox.take().dropped == {1: 10, 2: 1}
