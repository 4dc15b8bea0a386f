from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from hmcs.bus.timers import Timer, Timers


def fire(timers: Timers, now_ns: int) -> list[Timer]:
    fired = []
    while (timer := timers.pop_due(now_ns)) is not None:
        fired.append(timer)
    return fired


@given(st.integers(1, 50), st.lists(st.integers(0, 200), min_size=1))
def test_a_periodic_timer_stays_on_its_grid_and_skips_what_it_missed(period, waits) -> None:
    timers = Timers()
    timer = timers.add(period, Timer(lambda: None, period))
    now, last_tick = 0, 0
    for wait in waits:
        now += wait
        tick = now // period
        assert fire(timers, now) == ([timer] if tick > last_tick else [])
        last_tick = max(last_tick, tick)
        assert timers.next_due_ns() == (tick + 1) * period


@given(st.lists(st.integers(0, 30)))
def test_timers_fire_in_the_order_they_are_due_and_once(dues) -> None:
    timers = Timers()
    added = [(due, timers.add(due, Timer(lambda: None, None))) for due in dues]
    by_due = [timer for _, timer in sorted(added, key=lambda pair: pair[0])]
    assert fire(timers, 30) == by_due
    assert timers.next_due_ns() is None


def test_nothing_fires_before_it_is_due() -> None:
    timers = Timers()
    timers.add(10, Timer(lambda: None, None))
    assert fire(timers, 9) == []


def test_a_cancelled_timer_never_fires_again() -> None:
    timers = Timers()
    periodic = timers.add(1, Timer(lambda: None, 1))
    assert fire(timers, 1) == [periodic]
    periodic.cancel()
    assert fire(timers, 100) == []
    assert timers.next_due_ns() is None
