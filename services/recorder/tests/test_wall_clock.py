"""Times of a recording are those on the wall, whenever that clock is set."""

from __future__ import annotations

import pytest

from hmcs_recorder.wall_clock import SET_NS, STEADY_NS, WallClock

S = 1_000_000_000


class Clocks:
    """Two clocks that go as a test says."""

    def __init__(self) -> None:
        self.wall, self.monotonic, self.slow_ns = 1_790_000_000 * S, 5 * S, 0

    def pass_s(self, seconds: float) -> None:
        self.wall += round(seconds * S)
        self.monotonic += round(seconds * S)

    def made(self) -> WallClock:
        def monotonic() -> int:
            self.monotonic += self.slow_ns
            return self.monotonic

        return WallClock(lambda: self.wall, monotonic)


@pytest.fixture
def clocks() -> Clocks:
    return Clocks()


def test_times_rise_as_they_were_until_it_is_reckoned_anew(clocks: Clocks) -> None:
    clock = clocks.made()
    first = clock.of(clocks.monotonic)
    assert first == clocks.wall
    clocks.pass_s(10)
    clocks.wall -= 3600 * S
    assert clock.of(clocks.monotonic) - first == 10 * S == clock.now_ns() - first
    clock.reckon_anew()
    assert clock.now_ns() == clocks.wall


@pytest.mark.parametrize("by_s", [-7200, -1, 1, 8 * 3600], ids=lambda by_s: f"{by_s} s")
def test_that_the_clock_was_set_or_the_machine_slept_is_reported_once(
    clocks: Clocks, by_s: int
) -> None:
    clock = clocks.made()
    clocks.pass_s(10)
    assert clock.set_by_ns() == 0
    clocks.wall += by_s * S
    assert clock.set_by_ns() == by_s * S
    assert clock.set_by_ns() == 0


def test_a_clock_that_is_hurried_by_the_network_was_not_set(clocks: Clocks) -> None:
    clock = clocks.made()
    for _ in range(100):
        clocks.pass_s(60)
        clocks.wall += SET_NS // 30
        assert clock.set_by_ns() == 0


def test_on_a_busy_machine_nothing_is_concluded(clocks: Clocks) -> None:
    clock = clocks.made()
    clocks.wall += 100 * S
    clocks.slow_ns = STEADY_NS + 1
    assert clock.set_by_ns() == 0
    clocks.slow_ns = 0
    assert clock.set_by_ns() > 99 * S
