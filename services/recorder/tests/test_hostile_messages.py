"""Whatever others send costs that message alone."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest

from hmcs.bus.arrays import to_wire
from hmcs.bus.mailbox import Arrival
from hmcs.bus.messages import Motion
from hmcs.recordings import writing
from hmcs.recordings.inspection import inspected
from support.recorder import Bench
from support.stack import Stack


def packed(**fields: object) -> bytes:
    zeros = to_wire(np.zeros(3))
    source = {"service": "stranger", "instance": "one", "boot": "b"}
    legal = {"schema": "motion/1", "source": source, "seq": 0, "dead_man": True}
    data: bytes = msgpack.packb({**legal, "position": zeros, "velocity": zeros, **fields})
    return data


MALFORMED = [
    b"",
    b"\xc1",
    b"\x01",
    packed(schema=["motion/1"]),
    packed(schema=b"motion/1"),
    packed(schema=7),
    packed(schema="motion/99"),
    packed(source=None),
    packed(source=["a"]),
    packed(seq=None),
    packed(seq=[1]),
    packed(position=[0.0, 0.0, 0.0]),
    packed(position={"dtype": "<f8", "shape": [3], "data": b""}),
    packed(position={"dtype": ["<f8"], "shape": "x", "data": b"12345678"}),
    packed(position=to_wire(np.full(3, np.nan))),
    packed(origin=[]),
    packed(dead_man="yes"),
    b"\x91" * 5000 + b"\x01",
]


def test_malformed_messages_are_refused_one_by_one_and_every_other_is_recorded(
    stack: Stack, tmp_path: Path
) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    stranger = stack.open_bus("stranger", "one")
    for number, payload in enumerate(MALFORMED):
        stranger._session.put(stranger.keys.motion, payload)
        stranger._session.put(stranger.keys.motion, packed(seq=number))
    stack.until(lambda: bench.bus.counters.received[Motion.SCHEMA] >= len(MALFORMED))
    stack.until(lambda: bench.bus.counters.refused["recording"] >= len(MALFORMED))
    bench.sample(3)
    bench.service.close()
    assert bench.bus.counters.refused["recording"] == len(MALFORMED)
    content = bench.content()
    assert len(list(content.of(Motion))) == len(content.messages) == len(MALFORMED) + 3
    assert inspected(content).channels[0].lost == 0


def test_what_nobody_thought_of_costs_one_message(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    recording = bench.service._recording
    assert recording is not None
    write, calls = recording._file.write, iter(range(100))

    def fails_once(*args: Any) -> None:
        if next(calls) == 0:
            raise KeyError("surprise")
        write(*args)

    monkeypatch.setattr(recording._file, "write", fails_once)
    for k in range(4):
        bench.hand.sample([0.001 * k, 0.0, 0.0], np.zeros(3))
    stack.until(lambda: bench.bus.counters.received[Motion.SCHEMA] >= 3)
    bench.service.close()
    assert bench.bus.counters.refused["recording"] == 1
    assert len(bench.content().messages) == 3


def test_more_kinds_and_keys_than_a_file_has_room_for_are_refused(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writing, "MOST_CHANNELS", 3)
    bench = Bench(stack, tmp_path / "recordings")
    for number in range(10):
        bench.service._on_arrival(Arrival(f"a/b/c/k{number}", packed(), time.monotonic_ns()))
    bench.service.close()
    # Two of the three are for what viewers show.
    assert 0 < len(bench.content().messages) < 3
    assert bench.bus.counters.refused["recording"] >= 7
