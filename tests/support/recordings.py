"""Recordings that are made up, message by message."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hmcs.bus.keys import Keys
from hmcs.bus.messages import Envelope, Label, Message, Motion, Source, Step
from hmcs.bus.wire import encode
from hmcs.motion.steps import DeadZone
from hmcs.recordings.file_rotation import Limits, Preface, Recording
from hmcs.recordings.json_codec import fields_of

KEYS = Keys("test")
HAND = Source(service="input_device", instance="hand", boot="clock")
BEGUN_NS = 1_790_000_000_000_000_000
PERIOD_NS = 10_000_000
ROOMY = Limits(part_mb=100.0, part_s=1e6, limit_mb=1000.0, free_mb=0.0)
Said = tuple[str, Message]


class Maker:
    """Writes recordings whose every message is known."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def fields(self, body: Message, seq: int, source: Source = HAND) -> dict[str, Any]:
        return fields_of(encode(body, Envelope(source=source, seq=seq)))

    def begin(
        self,
        name: str = "take",
        limits: Limits = ROOMY,
        attachments: dict[str, bytes] | None = None,
    ) -> Recording:
        preface = Preface({"hmcs": {"version": "1.2.3"}}, attachments or {})
        return Recording(self.folder, name, limits, lambda: preface, BEGUN_NS, "test")

    def write(
        self,
        said: Sequence[Said],
        name: str = "take",
        limits: Limits = ROOMY,
        attachments: dict[str, bytes] | None = None,
        flush_every: int = 10**9,
    ) -> Path:
        recording = self.begin(name, limits, attachments)
        path = recording.path
        numbers: dict[str, int] = {}
        for count, (key, body) in enumerate(said):
            seq = numbers.get(key, 0)
            numbers[key] = seq + 1
            at_ns = BEGUN_NS + count * PERIOD_NS
            recording.write(key, self.fields(body, seq), at_ns, None)
            if count % flush_every == flush_every - 1:
                recording.flush()
        recording.finish()
        return path


def hand_of(labels: Sequence[str | None], samples: int) -> Iterator[Said]:
    """A hand that goes through labeled straight stretches, x first, then y, then z."""
    zone, position = DeadZone(0.01), np.zeros(3)
    yield KEYS.motion, Motion(position=position, velocity=np.zeros(3), dead_man=False)
    for turn, label in enumerate(labels):
        if label is None and turn:
            yield KEYS.label, Label(state="")
        if label is not None:
            yield KEYS.label, Label(state=label, clock=HAND.boot, step=zone.count)
        velocity = np.roll([0.2, 0.0, 0.0], turn)
        for _ in range(samples):
            position = position + 0.01 * velocity
            yield KEYS.motion, Motion(position=position, velocity=velocity, dead_man=True)
            step = zone.push(position)
            if step is not None:
                yield KEYS.step, Step(**step._asdict())
    yield KEYS.label, Label(state="")
    yield KEYS.motion, Motion(position=position, velocity=np.zeros(3), dead_man=False)
