"""A recording that lies in the repository opens and is replayed as on the day it was made."""

from __future__ import annotations

import hashlib
import lzma
from pathlib import Path

import numpy as np
import pytest

from hmcs.recordings.comparing import compared, fixtures_compared
from hmcs.recordings.demonstrations import demonstrations_of
from hmcs.recordings.fixture_replay import replay_fixture
from hmcs.recordings.labels import labels_of
from hmcs.recordings.reading import RecordingContent, read
from hmcs.recordings.replaying import kept_model, replayed

KEPT = Path(__file__).parent / "kept" / "reach-and-lift.mcap.xz"
"""Made by the first version of the recorder's format; its summary, labels and model are in it."""
TEXTS = "645ede233229ab98c25f732bb733c74e05642bab6b01851633240be9e551f96c"
"""SHA-256 of key, schema, text and times of every message in it."""
WAY = "116ca8029d77784644b64f6855cbc76ff2a7bcfbfb5a2fdd21b11b4d7e9b7dcf"
"""SHA-256 of positions and times of its demonstration."""
ARITHMETIC = "2d22e9a0864993f7c66fdb11689e6aa4bac5c132e3552d6df50e1ee548873041"
"""SHA-256 of exponentials and logarithms as the processor that recorded it rounded them."""


@pytest.fixture
def content(tmp_path: Path) -> RecordingContent:
    file = tmp_path / "kept.mcap"
    file.write_bytes(lzma.decompress(KEPT.read_bytes()))
    return read(file)


def same_arithmetic() -> bool:
    """Whether NumPy rounds here as it did there: it has other code for other processors."""
    numbers = np.linspace(1e-3, 30.0, 4001)
    rounded = np.concatenate([np.exp(numbers), np.exp(-numbers), np.log(numbers)])
    return hashlib.sha256(rounded.tobytes()).hexdigest() == ARITHMETIC


def test_every_message_is_read_to_the_last_bit(content: RecordingContent) -> None:
    digest = hashlib.sha256()
    for each in content.messages:
        digest.update(each.key.encode() + each.schema.encode() + each.text)
        digest.update(b"%d %d" % (each.log_ns, each.captured_ns))
    assert (len(content.messages), digest.hexdigest()) == (105, TEXTS)
    assert (content.whole, content.damage) == (True, "")
    assert (content.first_ns, content.last_ns) == (1790000000000000000, 1790000000268000000)
    assert content.metadata["hmcs"] == {"version": "1.2.3"}
    assert list(content.attachments) == ["kept.hmcs"]


def test_its_labels_and_its_demonstration_are_as_they_were(content: RecordingContent) -> None:
    said = [(label.begin_ns, label.end_ns, label.state) for label in labels_of(content)]
    first_ns = content.first_ns
    assert said == [
        (first_ns + 50_000_000, first_ns + 150_000_000, "reach"),
        (first_ns + 150_000_000, first_ns + 268_000_001, "lift"),
    ]
    (demonstration,) = demonstrations_of(content)
    way = demonstration.positions.tobytes() + demonstration.time_s.tobytes()
    assert (demonstration.name, hashlib.sha256(way).hexdigest()) == ("kept.mcap", WAY)


def test_it_is_replayed_to_the_last_bit(content: RecordingContent) -> None:
    replay = replayed(content, kept_model(content))
    beliefs = compared(replay)
    assert (beliefs.steps, beliefs.compared, beliefs.agreement) == (11, 11, 1.0)
    for believed in replay.beliefs:
        assert believed.recorded is not None
        np.testing.assert_allclose(
            believed.replayed.probabilities, believed.recorded.probabilities, atol=1e-12
        )
    if same_arithmetic():
        assert beliefs.same_bits == 11
    fixture = fixtures_compared(replay_fixture(content, replay))
    assert (fixture.ticks, fixture.compared) == (27, 27)
    assert (fixture.factor_close, fixture.same_state) == (1.0, 1.0)
    assert fixture.factor_apart < 1e-9
    assert (fixture.recorded_takes_hold, fixture.replayed_takes_hold) == (2, 2)
