"""The recorder is asked for outlines, and for labels to be written, while it records."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hmcs.bus.messages import Done, Message, Motion, Outline, OutlineQuestion, SetLabels
from hmcs.bus.session import RequestRefusedError
from hmcs.recordings.labels import labels_beside
from hmcs_recorder import labeling
from hmcs_recorder.service import Recorder
from hmcs_recorder.settings import RecorderSettings
from support.hand import Hand
from support.recordings import KEYS, Maker, hand_of
from support.stack import Stack


class Bench:
    """A recorder, a hand, and somebody who asks."""

    def __init__(self, stack: Stack, folder: Path, **settings: Any) -> None:
        self.stack, self.folder = stack, folder
        self.asker = stack.open_bus("console", "page")
        self.hand = Hand(stack.open_bus("input_device", "hand"))
        self.bus = stack.open_bus("recorder", "here")
        reported = RecorderSettings(folder=folder, flush_s=0.05, free_mb=0.0, **settings)
        self.service = Recorder(reported, self.bus, logging.getLogger("test"))
        self.service.start()

    def asked(self, verb: str, question: Message, answer: type[Message]) -> Any:
        """What the recorder answers over the bus, while everybody is pumped."""
        key = self.asker.keys.rpc("recorder", "here", verb)
        with ThreadPoolExecutor(1) as aside:
            coming = aside.submit(self.asker.ask, key, question, answer, 10.0)
            self.stack.until(coming.done)
        (got,) = coming.result()
        return got.body


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    with Stack(tmp_path) as stack:
        made = Bench(stack, tmp_path / "recordings", autostart=False)
        yield made
        made.service.close()


def labels(**changed: Any) -> SetLabels:
    reported = {
        "recording": "take.mcap",
        "begin_s": np.array([0.1, 0.5]),
        "end_s": np.array([0.5, 0.9]),
        "states": ("turn", "go"),
    }
    return SetLabels(**(reported | changed))


def test_labels_that_are_set_are_in_the_next_outline(bench: Bench) -> None:
    path = Maker(bench.folder).write(list(hand_of(("go", "turn"), 60)))
    before = path.read_bytes()
    outline = bench.asked("outline", OutlineQuestion(), Outline)
    assert (outline.recordings, outline.recording) == (("take.mcap",), "take.mcap")
    assert outline.path == str(path)
    assert outline.states == ("go", "turn")
    assert outline.position.shape == (120, 3)
    done = bench.asked("set_labels", labels(), Done)
    assert "2 labels written to" in done.detail
    again = bench.asked("outline", OutlineQuestion(recording="take.mcap"), Outline)
    assert again.states == ("turn", "go")
    np.testing.assert_allclose(again.begin_s, [0.1, 0.5])
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"recording": "../take.mcap"}, "there is no recording"),
        ({"recording": ""}, "say which recording"),
        ({"begin_s": np.array([0.1, 0.4])}, "begins before"),
        ({"end_s": np.array([0.5, 99.0])}, "outside of the recording"),
        ({"begin_s": np.array([0.6, 0.5])}, "let it begin before it ends"),
        ({"states": ("go",)}, "2 labels begin, 2 end, and 1 say"),
    ],
)
def test_labels_that_cannot_be_are_refused_and_nothing_is_written(
    bench: Bench, changed: dict[str, Any], says: str
) -> None:
    path = Maker(bench.folder).write(list(hand_of(("go",), 100)))
    with pytest.raises(RequestRefusedError, match=says):
        bench.asked("set_labels", labels(**changed), Done)
    assert not labels_beside(path).exists()


def test_a_recording_that_is_too_large_is_refused_with_the_remedy(tmp_path: Path) -> None:
    Maker(tmp_path).write(list(hand_of(("go",), 60)))
    settings = RecorderSettings(folder=tmp_path, outline_mb=1e-3)
    with pytest.raises(RequestRefusedError, match=r"outline_mb.*`hmcs label .*take\.mcap`"):
        labeling.outline_of(settings, OutlineQuestion())


def test_what_is_being_recorded_is_outlined_and_goes_on_being_recorded(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    stack, received = bench.stack, bench.bus.counters.received
    bench.service._begin("now")
    stack.until(lambda: bench.hand._motions.matching)
    for k in range(20):
        bench.hand.sample([0.01 * k, 0.0, 0.0], np.zeros(3))
    stack.until(lambda: received[Motion.SCHEMA] >= 20)
    bench.service._on_flush()
    read = labeling.read

    def read_meanwhile(path: Path) -> Any:
        # It is read only once the recorder has written down what comes while it reads.
        for k in range(20, 40):
            bench.hand.sample([0.01 * k, 0.0, 0.0], np.zeros(3))
        while received[Motion.SCHEMA] < 40:
            pass
        return read(path)

    monkeypatch.setattr(labeling, "read", read_meanwhile)
    outline = bench.asked("outline", OutlineQuestion(), Outline)
    assert outline.recording == "now.mcap"
    assert len(outline.time_s) >= 20
    assert received[Motion.SCHEMA] == 40


def test_a_motion_that_no_answer_can_hold_is_refused_with_what_is_wrong(tmp_path: Path) -> None:
    # Every sample is within what a message may say; the way of the engaged hand leads out of it.
    far = np.array([9e8, 0.0, 0.0])
    samples = [
        Motion(position=side * far, velocity=np.zeros(3), dead_man=dead_man)
        for _ in range(20)
        for side, dead_man in ((-1.0, False), (-1.0, True), (1.0, True))
    ]
    Maker(tmp_path).write([(KEYS.motion, sample) for sample in samples])
    settings = RecorderSettings(folder=tmp_path)
    with pytest.raises(RequestRefusedError, match=r"take\.mcap cannot be shown, its position .*1e"):
        labeling.outline_of(settings, OutlineQuestion())
