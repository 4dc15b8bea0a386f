"""The times of recorded messages, whatever the clocks do."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.bus.mailbox import Arrival
from hmcs.bus.messages import Envelope, Motion, Origin, Record
from hmcs.bus.wire import encode
from hmcs.recordings.reading import read
from hmcs_recorder import service
from support.recorder import Bench
from support.stack import Stack


class SetClock:
    """`time` whose wall clock is set by so many ns."""

    def __init__(self) -> None:
        self.by_ns = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(time, name)

    def time_ns(self) -> int:
        return time.time_ns() + self.by_ns


@pytest.mark.parametrize("by_s", [8 * 3600, -7200])
def test_messages_carry_the_time_on_the_wall_whenever_the_clock_is_set(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, by_s: int
) -> None:
    clock = SetClock()
    monkeypatch.setattr(service, "time", clock)
    bench = Bench(stack, tmp_path / "recordings", autostart=False)
    clock.by_ns = by_s * 10**9
    bench.service._asked(Record(on=True, name="take"))
    bench.sample(5)
    # And once more while it records.
    clock.by_ns = 2 * by_s * 10**9
    bench.sample(7)
    now_ns = clock.time_ns()
    bench.service.close()
    before, after = (read(bench.folder / f"take{part}.mcap") for part in ("", "-002"))
    assert [len(list(content.of(Motion))) for content in (before, after)] == [5, 7]
    assert abs(after.last_ns - now_ns) < 60 * 10**9
    assert abs(before.last_ns + by_s * 10**9 - now_ns) < 60 * 10**9
    for content in (before, after):
        times = [message.log_ns for message in content.messages]
        assert times == sorted(times)
    assert sorted(file.name for file in bench.folder.iterdir()) == ["take-002.mcap", "take.mcap"]


def test_a_capture_reported_by_another_machines_clock_is_as_if_it_were_not_reported(
    stack: Stack, tmp_path: Path
) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    hand = bench.hand
    motion = Motion(position=np.zeros(3), velocity=np.zeros(3), dead_man=True)
    now_ns = time.monotonic_ns()
    captures = [now_ns, now_ns - 60 * 10**9, now_ns + 60 * 10**9, 0, -(2**62), 2**62]
    for captured_ns in captures:
        origin = Origin(boot=hand.clock, seq=0, captured_ns=captured_ns)
        hand._motions.put(motion, origin)
    stack.until(lambda: bench.bus.counters.received[Motion.SCHEMA] >= len(captures))
    bench.service.close()
    apart = [m.log_ns - m.captured_ns for m, _, _ in bench.content().of(Motion)]
    assert 0 < apart[0] <= 5_000_000_000
    assert apart[1:] == [0] * 5


def test_what_was_received_while_it_began_is_not_logged_before_it_began(
    stack: Stack, tmp_path: Path
) -> None:
    bench = Bench(stack, tmp_path / "recordings", autostart=False)
    bench.service._begin("take")
    begun_ns = bench.service._earliest_ns
    motion = Motion(position=np.zeros(3), velocity=np.zeros(3), dead_man=True)
    envelope = Envelope(source=bench.hand.bus.source, seq=0)
    for ago_ns in (10**9, 2 * 10**9):
        payload = encode(motion, envelope)
        bench.service._on_arrival(Arrival("k", payload, time.monotonic_ns() - ago_ns))
    bench.service.close()
    content = bench.content()
    assert content.first_ns == content.last_ns == begun_ns
