"""The recorder on the bus: what it records, when, and what it does when it cannot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hmcs.bus.messages import Ask, Health, Motion, Record, Step
from hmcs.bus.session import RequestRefusedError
from hmcs.motion.steps import DeadZone
from hmcs.recordings.inspection import inspected
from hmcs.recordings.reading import read
from support.hand import Hand
from support.recorder import Bench, pumped
from support.stack import Stack


def test_every_message_is_recorded_in_order_with_when_it_was_taken(
    stack: Stack, tmp_path: Path
) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    bench.sample(50)
    bench.service.close()
    content = bench.content()
    motions = [motion for _, _, motion in content.of(Motion)]
    assert len(motions) == 50
    np.testing.assert_array_equal([m.position[0] for m in motions], 0.001 * np.arange(50))
    for recorded, envelope, _ in content.of(Motion):
        assert envelope.origin is not None
        assert 0 <= recorded.log_ns - recorded.captured_ns < 5_000_000_000
    assert inspected(content).channels[0].lost == 0


def test_recording_begins_and_ends_when_asked(stack: Stack, tmp_path: Path) -> None:
    bench = Bench(stack, tmp_path / "recordings", autostart=False)
    assert "waiting" in bench.service.health()[1]
    with pytest.raises(RequestRefusedError, match="nothing is being recorded"):
        bench.service._asked(Record(on=False))
    assert "take-1.mcap" in bench.service._asked(Record(on=True, name="take-1")).detail
    with pytest.raises(RequestRefusedError, match="being recorded already"):
        bench.service._asked(Record(on=True))
    bench.sample(3)
    assert "ended" in bench.service._asked(Record(on=False)).detail
    assert len(list(read(tmp_path / "recordings" / "take-1.mcap").of(Motion))) == 3


def test_a_full_disk_ends_the_recording_which_is_reported_and_counted(
    stack: Stack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    bench.sample(5)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    assert bench.service._recording is not None
    monkeypatch.setattr(bench.service._recording._file, "write", full)
    bench.hand.sample(np.zeros(3), np.zeros(3))
    bench.hand.sample(np.zeros(3), np.zeros(3))
    stack.until(lambda: bench.bus.counters.lost["recording"] == 2)
    well, detail = bench.service.health()
    assert not well
    assert "2 messages lost" in detail
    assert "No space left" in detail
    # There is room again: it goes on by itself, in a new file.
    bench.service._again_s = 0.0
    stack.until(lambda: bench.service.health()[0])
    bench.sample(4)
    bench.service.close()
    parts = sorted(bench.folder.glob("*.mcap"), key=lambda file: file.stat().st_mtime)
    assert sum(len(list(read(part).of(Motion))) for part in parts) >= 4


def test_what_is_no_message_is_refused_and_the_rest_recorded(stack: Stack, tmp_path: Path) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    stranger = stack.open_bus("stranger", "one")
    stranger._session.put(stranger.keys.step, b"\xc1")
    stack.until(lambda: bench.bus.counters.refused["recording"] == 1)
    bench.sample(2)
    bench.service.close()
    assert len(bench.content().messages) == 2


def test_what_was_flushed_outlives_kill_9_and_the_others_go_on(
    stack: Stack, tmp_path: Path
) -> None:
    bus = stack.open_bus("input_device", "hand")
    stack.watch(bus)
    hand = Hand(bus)
    folder = tmp_path / "recordings"
    recorder = stack.bring_up(
        "recorder", "disk", "--folder", folder, "--flush-s", "0.05", "--free-mb", "0"
    )
    key = bus.keys.rpc("recorder", "disk", "health")

    def recorded() -> int:
        hand.sample(np.zeros(3), np.zeros(3))
        answers = bus.ask(key, Ask(), Health)
        return answers[0].body.received.get(Motion.SCHEMA, 0) if answers else 0

    stack.until(lambda: recorded() >= 20)
    sent = hand._samples

    def safe() -> int:
        hand.sample(np.zeros(3), np.zeros(3))
        (file,) = folder.glob("*.mcap")
        return len(list(read(file).of(Motion)))

    stack.until(lambda: safe() >= sent)
    recorder.kill()
    stack.until_gone(recorder)
    hand.sample(np.zeros(3), np.zeros(3))
    (file,) = folder.glob("*.mcap")
    content = read(file)
    assert len(list(content.of(Motion))) >= sent
    assert any("cut off" in problem for problem in inspected(content).problems)


def test_a_recorder_says_where_it_records(stack: Stack, tmp_path: Path) -> None:
    bench = Bench(stack, tmp_path / "recordings")
    facts = bench.service.facts()
    assert facts["recording"].endswith(".mcap")
    assert facts["folder"] == str(tmp_path / "recordings")


def test_steps_made_before_it_began_are_in_a_recording(stack: Stack, tmp_path: Path) -> None:
    early = Hand(stack.open_bus("input_device", "early"))
    zone = DeadZone(0.01)
    made = [step for k in range(30) if (step := zone.push([0.01 * k, 0.0, 0.0])) is not None]
    for step in made[:20]:
        early.keep(step)
    with pumped(early.bus):
        bench = Bench(stack, tmp_path / "recordings")
    for step in made[20:]:
        early.step(step)
    stack.until(lambda: bench.bus.counters.received[Step.SCHEMA] >= len(made) - 20)
    bench.service.close()
    steps = [step.index for _, _, step in bench.content().of(Step)]
    assert steps == [step.index for step in made]
